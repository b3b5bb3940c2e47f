"""A convex mirror: where its ring shows what, and numbers that describe none."""

import numpy as np
import pytest

from fisheye_core.errors import CalibrationError
from fisheye_geometry.image_circle import LensWithImageCircle
from fisheye_geometry.lens import AnnularLens, make_lens
from fisheye_geometry.lens_surface import surface_for

EXACT = 1e-9
INNER, FIRST, LAST = 0.25, np.radians(-50), np.radians(20)
MIRROR = AnnularLens(480, 400, 190.0, 190.0, 239.5, 199.5, (INNER, FIRST, LAST, 1.0))


def pixel_of(lens, bearing_deg, elevation_deg):
    bearing, elevation = np.radians([bearing_deg, elevation_deg])
    ray = [np.sin(bearing) * np.cos(elevation), -np.sin(elevation)]
    return lens.project(np.array([*ray, np.cos(bearing) * np.cos(elevation)]))


def test_forward_is_above_the_centre_and_right_to_its_right():
    (x, y), seen = pixel_of(MIRROR, 0, 20)
    assert seen
    assert (x, y) == pytest.approx((239.5, 199.5 - 190), abs=EXACT)
    (x, y), _ = pixel_of(MIRROR, 90, -50)
    assert (x, y) == pytest.approx((239.5 + INNER * 190, 199.5), abs=EXACT)


def test_seen_from_below_bearings_follow_each_other_counterclockwise():
    from_below = AnnularLens(480, 400, 190.0, 190.0, 239.5, 199.5, (INNER, FIRST, LAST, -1.0))
    (x, _), _ = pixel_of(from_below, 90, 0)
    assert x < 239.5


def test_what_is_above_and_below_the_ring_is_not_seen():
    assert [bool(pixel_of(MIRROR, 30, elevation)[1]) for elevation in (21, 19, -49, -51)] == [
        False,
        True,
        True,
        False,
    ]
    assert not MIRROR.unproject(np.array([239.5, 199.5]))[1]


def test_pixels_come_back_from_their_rays():
    y, x = np.mgrid[0:400:7, 0:480:7]
    pixels = np.stack([x, y], axis=-1).astype(float)
    rays, seen = MIRROR.unproject(pixels)
    back, also_seen = MIRROR.project(rays[seen])
    assert also_seen.all()
    assert np.abs(back - pixels[seen]).max() < 1e-6
    assert np.linalg.norm(rays, axis=-1) == pytest.approx(np.ones(x.shape))


def test_it_unrolls_to_a_surface_that_leads_all_around():
    surface = surface_for(MIRROR)
    assert surface.width == round(2 * np.pi * 190)
    top, bottom = surface.rays(0, np.array([-0.5, surface.height - 0.5]))
    assert np.arctan2(-top[1], np.hypot(top[0], top[2])) == pytest.approx(LAST, abs=0.003)
    assert np.arctan2(-bottom[1], np.hypot(bottom[0], bottom[2])) == pytest.approx(FIRST, abs=0.01)


def test_its_picture_is_no_circle_to_look_for():
    seen = LensWithImageCircle(MIRROR)
    picture = np.zeros((400, 480), np.uint8)
    picture[150:250, 200:280] = 200
    assert seen.look(picture)
    assert not seen.look(picture)
    assert (seen.note, seen.lens) == ('', MIRROR.with_max_angle(np.pi))


def test_the_model_has_a_name():
    matrix = [190, 0, 239.5, 0, 190, 199.5, 0, 0, 1]
    assert make_lens('annular', 480, 400, matrix, MIRROR.distortion) == MIRROR


@pytest.mark.parametrize(
    ('numbers', 'words'),
    [
        ((1.5, -0.5, 0.3, 1), 'inner radius of an annular lens is 1.5 outer ones; expected'),
        ((0.3, 0.3, 0.3, 1), 'elevations of 0.3 and 0.3 rad; expected different ones'),
        ((0.3, -0.5, 2.0, 1), 'between -1.57 and 1.57 rad'),
        ((0.3, -0.5, 0.3, 0), r'direction of an annular lens is 0; expected 1 \(clockwise\)'),
        ((0.3, -0.5), 'annular. has 4'),
    ],
)
def test_impossible_mirrors_are_refused(numbers, words):
    with pytest.raises(CalibrationError, match=words):
        AnnularLens(480, 400, 190.0, 190.0, 239.5, 199.5, numbers)
