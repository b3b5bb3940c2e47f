"""The synthetic world: the same in every process, and the truth of what a panorama shows."""

import hashlib
import os
import subprocess
import sys

import numpy as np
import pytest

from fisheye_capture.ball import PERIOD_NS, Ball
from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import FisheyeLens
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import remap_table
from fisheye_geometry.surface import SURFACES

LEFT = Attitude(yaw_rad=np.radians(-70))
AT_SEAM_NS = 200_000_000
"""The ball is then in the view of the left camera and in that of the right one."""
TRUTH_PSNR_DB = 36.0
"""Little may be lost between lens and truth, against the 30 dB that are asked of a panorama."""


def lens_of(width, height):
    return synthetic_lens(width, height, np.radians(170))


def psnr_db(image, truth, valid):
    error = image[valid].astype(float) - truth[valid]
    return 10 * np.log10(255**2 / np.mean(error**2))


@pytest.fixture(scope='module')
def left():
    return Scene().view(lens_of(640, 480), LEFT)


@pytest.mark.parametrize('kind', SURFACES)
@pytest.mark.parametrize('size', [(640, 480), (320, 240)])
def test_a_corrected_picture_is_the_truth_of_its_surface(kind, size):
    lens = lens_of(*size)
    surface = surface_for(lens, kind)
    table = remap_table(lens, surface)
    corrected = table(Scene().view(lens, LEFT).frame(AT_SEAM_NS))
    truth = Scene().view(surface, LEFT).frame(AT_SEAM_NS)
    assert psnr_db(corrected, truth, table.valid) >= TRUTH_PSNR_DB


def test_a_turned_camera_sees_the_same_world():
    lens, turn = lens_of(640, 480), Attitude(0.3, 0.05, -0.04)
    surface = surface_for(lens)
    table = remap_table(lens, surface, 'linear', turn)
    corrected = table(Scene().view(lens, turn).frame(AT_SEAM_NS))
    truth = Scene().view(surface).frame(AT_SEAM_NS)
    assert psnr_db(corrected, truth, table.valid) >= TRUTH_PSNR_DB


def test_equal_stamps_give_equal_pictures_in_every_process(left):
    program = (
        'import hashlib, numpy as np\n'
        'from fisheye_capture.scene import Scene\n'
        'from fisheye_capture.synthetic import synthetic_lens\n'
        'from fisheye_geometry.attitude import Attitude\n'
        'lens = synthetic_lens(640, 480, np.radians(170))\n'
        'view = Scene().view(lens, Attitude(yaw_rad=np.radians(-70)))\n'
        f'print(hashlib.sha256(view.frame({AT_SEAM_NS})).hexdigest())\n'
    )
    other = subprocess.run(
        [sys.executable, '-c', program],
        env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert other.stdout.strip() == hashlib.sha256(left.frame(AT_SEAM_NS)).hexdigest()


def test_only_the_ball_moves_and_it_comes_back(left):
    before, after = left.frame(AT_SEAM_NS), left.frame(AT_SEAM_NS + 100_000_000)
    moved = (before != after).any(axis=2)
    assert 0 < moved.mean() < 0.05
    np.testing.assert_array_equal(left.frame(AT_SEAM_NS + PERIOD_NS), before)


def test_the_ball_crosses_the_seam_both_ways():
    bearings = [Ball.at(t).bearing_rad for t in range(0, PERIOD_NS, PERIOD_NS // 48)]
    assert np.degrees([min(bearings), max(bearings)]) == pytest.approx([-40, 40], abs=0.5)
    assert np.count_nonzero(np.diff(np.sign(np.round(bearings, 9)))) >= 2


def test_a_frame_belongs_to_who_asked_for_it(left):
    frame = left.frame(0)
    frame[:] = 0
    assert left.frame(0).any()


def test_out_of_sight_the_ball_changes_nothing():
    behind = Scene().view(lens_of(320, 240), Attitude(yaw_rad=np.pi))
    np.testing.assert_array_equal(behind.frame(AT_SEAM_NS), behind.frame(AT_SEAM_NS + 10**9))


def test_it_is_dark_outside_the_image_circle():
    lens = lens_of(320, 240).with_max_angle(np.radians(60))
    frame = Scene().view(lens).frame(AT_SEAM_NS)
    y, x = np.ogrid[:240, :320]
    _, seen = lens.unproject(np.stack(np.broadcast_arrays(x, y), axis=-1))
    assert not frame[~seen].any()
    assert frame[seen].any(axis=-1).all()


def test_an_exposure_of_1_3_saturates_nothing():
    lens = lens_of(320, 240)
    plain, bright = (Scene().view(lens, LEFT, gain).frame(AT_SEAM_NS) for gain in (1.0, 1.3))
    assert bright.max() < 255
    assert bright.mean() == pytest.approx(1.3 * plain.mean(), rel=0.01)


@pytest.mark.parametrize('fov_deg', [90, 170, 220])
def test_the_field_of_view_spans_the_picture(fov_deg):
    lens = synthetic_lens(800, 600, np.radians(fov_deg))
    assert isinstance(lens, FisheyeLens)
    edges = [lens.angle_at(x, lens.center_y_px) for x in (-0.5, 799.5)]
    assert np.degrees(edges) == pytest.approx([fov_deg / 2, fov_deg / 2])


@pytest.mark.parametrize('size', [(1, 1), (1, 100), (3, 1)])
def test_the_smallest_picture_is_drawn(size):
    assert Scene().view(lens_of(*size)).frame(0).shape == (*size[::-1], 3)
