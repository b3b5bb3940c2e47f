"""The image circle: found where there is one, and not taken for it at night."""

import numpy as np
import pytest

from fisheye_geometry.image_circle import ImageCircle, LensWithImageCircle
from fisheye_geometry.lens import make_lens

LENS = make_lens('equidistant', 640, 480, [150, 0, 310, 0, 150, 245, 0, 0, 1], [-0.02, 0, 0, 0])
RING_DEG = 1.0
"""Rings are 0.4 degrees wide and the edge may fall between two."""
RANDOM = np.random.default_rng(5)


def picture(circle_deg, brightness, noise):
    y, x = np.mgrid[0:480, 0:640]
    rays, seen = LENS.unproject(np.stack([x, y], -1))
    lit = seen & (rays[..., 2] > np.cos(np.radians(circle_deg)))
    scene = brightness * RANDOM.uniform(0.6, 1.0, (480, 640, 3)) * lit[..., None]
    return np.clip(scene + RANDOM.normal(0, noise, scene.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize('circle_deg', [60, 88, 95])
@pytest.mark.parametrize('noise', [0, 3, 8])
def test_it_is_found(circle_deg, noise):
    circle = ImageCircle(LENS)
    assert circle.look(picture(circle_deg, 120, noise))
    assert np.degrees(circle.angle_rad) == pytest.approx(circle_deg, abs=RING_DEG)
    assert not circle.look(picture(circle_deg, 120, noise)), 'it does not change'


def test_light_up_to_the_corners_is_no_circle():
    circle = ImageCircle(LENS)
    assert not circle.look(picture(180, 120, 3))
    assert circle.angle_rad == LENS.max_angle_rad


def test_night_tells_nothing():
    circle = ImageCircle(LENS)
    assert not circle.look(picture(90, 0, 3))
    assert circle.angle_rad == LENS.max_angle_rad


def test_what_was_seen_lit_is_never_dark_again():
    circle = ImageCircle(LENS)
    circle.look(picture(70, 120, 3))
    assert circle.look(picture(90, 120, 3))
    assert not circle.look(picture(70, 120, 3))
    assert np.degrees(circle.angle_rad) == pytest.approx(90, abs=RING_DEG)


def test_a_picture_of_another_size_is_ignored():
    assert not ImageCircle(LENS).look(np.zeros((10, 10), np.uint8))


def test_the_circle_of_a_lens_is_looked_for_ever_more_seldom():
    seen = LensWithImageCircle(LENS)
    whole = seen.lens
    assert seen.look(np.zeros((LENS.height, LENS.width), np.uint8)), 'the first is always news'
    told = [seen.look(picture(70, 120, 3)) for _ in range(3)]
    assert told == [True, False, False]
    assert seen.lens.max_angle_rad < whole.max_angle_rad


ENDING = make_lens('equidistant', 640, 480, [250, 0, 320, 0, 250, 240, 0, 0, 1], [-0.45, 0, 0, 0])
"""Its radius grows up to 49.3 degrees, 0.57 focal lengths: 143 px."""


def test_a_lens_that_ends_within_its_pictures_is_told():
    seen = LensWithImageCircle(ENDING)
    seen.look(np.zeros((480, 640, 3), np.uint8))
    assert seen.note == '', 'a dark picture may be one within its circle'
    seen.look(np.full((480, 640, 3), 120, np.uint8))
    assert 'ends 49.3 degrees off its axis' in seen.note
    assert 'cut to 99 degrees' in seen.note
    seen.look(np.zeros((480, 640, 3), np.uint8))
    seen.look(np.zeros((480, 640, 3), np.uint8))
    assert seen.note, 'it stays true at night'


def test_a_lens_whose_circle_ends_first_is_not_told():
    seen = LensWithImageCircle(ENDING)
    y, x = np.mgrid[0:480, 0:640]
    circle = 200 * (np.hypot(x - 320, y - 240) < 140)
    assert seen.look(circle.astype(np.uint8))
    assert seen.note == ''
    seen = LensWithImageCircle(LENS)
    assert seen.look(picture(180, 120, 3))
    assert seen.note == ''
