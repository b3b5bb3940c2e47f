"""Where a seam comes to lie."""

import numpy as np
import pytest
from scenes import placed_at

from fisheye_geometry.lens import make_lens
from fisheye_geometry.lens_surface import surface_for
from panorama_stitch.compose.layout import lay_out
from panorama_stitch.compose.seam import optimise_seams
from panorama_stitch.compose.view import View

SURFACE = surface_for(make_lens('plumb_bob', 200, 120, [150, 0, 99.5, 0, 150, 59.5, 0, 0, 1], []))
OVERLAP_PX = 80
OFFSET_PX = SURFACE.width - OVERLAP_PX
VIEWS = [View(SURFACE, SURFACE)] * 2
FADE_PX = 10.0


def texture(seed, width):
    noise = np.random.default_rng(seed).normal(0, 1, (SURFACE.height, width))
    return np.clip(120 + 20 * noise, 1, 255).astype(np.uint8)


def frames():
    """Two frames that show the same in their overlap."""
    scene = texture(1, OFFSET_PX + SURFACE.width)
    return [scene[:, : SURFACE.width].copy(), scene[:, OFFSET_PX:].copy()]


def settled(images, views=VIEWS, fade_px=FADE_PX):
    placed = placed_at(views, (OFFSET_PX, 0))
    layout = lay_out(placed, fade_px=fade_px, crop='none')
    return layout, optimise_seams(layout, placed, images)


def test_where_the_views_agree_everywhere_it_stays_in_the_middle():
    before, after = settled(frames())
    assert abs(after.seams[0].begin - before.seams[0].begin) <= 1
    assert after.seams[0].end - after.seams[0].begin == FADE_PX


@pytest.mark.parametrize('exposure', [1.0, 0.7])
def test_it_goes_around_what_the_views_do_not_agree_on(exposure):
    images = frames()
    middle = OVERLAP_PX // 2
    images[1][20:100, middle - 12 : middle + 8] = texture(2, 20)[20:100]
    images[1] = (images[1] * exposure).astype(np.uint8)
    _, after = settled(images)
    begin, end = OFFSET_PX + middle - 12, OFFSET_PX + middle + 8
    assert after.seams[0].begin >= end or after.seams[0].end <= begin


def test_it_stays_where_both_views_show_something():
    images = frames()
    middle = OVERLAP_PX // 2
    images[1][:, middle - 12 : middle + 8] = texture(2, 20)
    seen = np.ones(images[0].shape, bool)
    seen[:, OFFSET_PX + middle + 15 :] = False
    views = [View(SURFACE, SURFACE, seen=seen), VIEWS[1]]
    _, after = settled(images, views)
    assert after.seams[0].end <= OFFSET_PX + middle + 15


@pytest.mark.parametrize('fade_px', [0.0, 500.0])
def test_a_seam_without_room_to_move_is_left_alone(fade_px):
    before, after = settled(frames(), fade_px=fade_px)
    assert after == before
