"""Cameras: what can be none, and the part of the sensor that pictures show."""

import math

import cv2
import numpy as np
import pytest

from fisheye_core.errors import CalibrationError
from fisheye_geometry.camera import IDENTITY, Camera, Readout, camera_from
from fisheye_geometry.lens import make_lens

LENS = make_lens(
    'equidistant', 640, 480, [150, 0.5, 310, 0, 151, 245, 0, 0, 1], [-0.02, 0.004, -0.001, 0]
)
P = (140.0, 0.0, 312.0, 3.0, 0.0, 140.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0)
RAYS = np.random.default_rng(1).normal((0, 0, 2), size=(50, 3))


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'rectification': (*IDENTITY[:8], math.nan)}, 'R holds nan; expected finite'),
        ({'projection': (*P[:11], math.inf)}, 'P holds inf; expected finite'),
    ],
)
def test_what_is_not_finite_is_refused(change, words):
    with pytest.raises(CalibrationError, match=words):
        Camera('', LENS, **change)


@pytest.mark.parametrize('center', [-1e6, -20_000, 20_000])
@pytest.mark.parametrize(('model', 'd'), [('equidistant', [0] * 4), ('plumb_bob', [0.1] * 5)])
def test_a_principal_point_far_from_the_picture_is_refused(center, model, d):
    lens = make_lens(model, 640, 480, [150, 0, center, 0, 150, 240, 0, 0, 1], d)
    with pytest.raises(CalibrationError, match=r'center_x_px is .*; expected it within'):
        Camera('', lens)


def test_a_lens_beside_its_picture_is_refused():
    lens = make_lens('equidistant', 640, 480, [150, 0, 320, 0, 150, -500, 0, 0, 1], [0] * 4)
    with pytest.raises(CalibrationError, match=r'no ray meets the picture of .* -500\)'):
        Camera('', lens)


@pytest.mark.parametrize(
    ('focal_px', 'd', 'words'),
    [
        (
            (1e6, 223),
            [0] * 5,
            r'focal lengths are 1e\+06 and 223 px; expected 1 px .*',
        ),
        ((0.1, 0.1), [0] * 5, 'focal lengths are 0.1 and 0.1 px; expected 1 px or more'),
        ((223, 223), [0, 0, 0, -1e6, 0], 'ends 0 degrees off its axis; expected 1 or more'),
    ],
)
def test_what_no_camera_has_is_refused(focal_px, d, words):
    matrix = [focal_px[0], 0, 319.5, 0, focal_px[1], 239.5, 0, 0, 1]
    with pytest.raises(CalibrationError, match=words):
        Camera('', make_lens('plumb_bob', 640, 480, matrix, d))


def test_zeros_of_a_message_mean_that_nothing_is_given():
    assert camera_from('a', LENS, [0.0] * 9, [0.0] * 12) == Camera('a', LENS)


def test_all_of_the_sensor_is_the_camera_itself():
    camera = Camera('a', LENS, projection=P)
    for readout in (Readout(), Readout(0, 0, 640, 480, 1, 1)):
        assert readout.of(camera) == camera


def test_a_part_is_the_picture_cut_out():
    part = Readout(100, 60, 300, 200).of(Camera('a', LENS, projection=P))
    assert (part.lens.width, part.lens.height) == (300, 200)
    np.testing.assert_allclose(
        part.lens.project(RAYS)[0], LENS.project(RAYS)[0] - (100, 60), atol=1e-9
    )
    at = np.array([0.3, -0.2, 1.0, 0.0])
    whole = Camera('a', LENS, projection=P).projection_matrix @ at
    np.testing.assert_allclose(part.projection_matrix @ at, whole - (100, 60, 0), atol=1e-9)


def test_binned_pixels_are_the_middle_of_those_that_make_them():
    # A dot four pixels wide, on a block of the binning: its centre is known in both pictures.
    sensor = np.zeros((480, 640), np.float32)
    sensor[240:244, 320:324] = 1
    binned = cv2.resize(sensor, (320, 120), interpolation=cv2.INTER_AREA)
    centres = []
    for image in (sensor, binned):
        y, x = np.indices(image.shape)
        centres.append(np.array([(x * image).sum(), (y * image).sum()]) / image.sum())
    ray, _ = LENS.unproject(centres[0])
    camera = Readout(binning_x=2, binning_y=4).of(Camera('a', LENS))
    assert (camera.lens.width, camera.lens.height) == (320, 120)
    np.testing.assert_allclose(camera.lens.project(ray)[0], centres[1], atol=1e-9)


def test_both_together_are_one_after_the_other():
    camera = Camera('a', LENS, projection=P)
    at_once = Readout(100, 60, 301, 200, 2, 2).of(camera)
    in_turn = Readout(binning_x=2, binning_y=2).of(Readout(100, 60, 301, 200).of(camera))
    assert (at_once.lens.width, at_once.lens.height) == (150, 100)
    assert at_once.lens == in_turn.lens
    np.testing.assert_allclose(at_once.projection, in_turn.projection)


@pytest.mark.parametrize(
    ('readout', 'words'),
    [
        (Readout(400, 0, 300, 200), 'roi has 300 px from 400 on along x; expected .* the 640 px'),
        (Readout(y_offset=1), 'roi has 480 px from 1 on along y; expected .* the 480 px'),
        (Readout(binning_x=641), 'binning_x is 641; expected up to 640 px'),
        (Readout(0, 0, 4, 4, 1, 5), 'binning_y is 5; expected up to 4 px'),
    ],
)
def test_what_is_not_on_the_sensor_is_refused(readout, words):
    with pytest.raises(CalibrationError, match=words):
        readout.of(Camera('a', LENS))
