"""Blends: what both show stays, what they differ in fades, what one shows alone is taken whole."""

import numpy as np
import pytest

from panorama_stitch.compose.blend import Feather, Multiband
from panorama_stitch.compose.blends import BLENDS

SHAPE = (90, 64, 3)
EVERYWHERE = np.ones(SHAPE[:2], bool)
KINDS = list(dict.fromkeys(blend.kind for blend in BLENDS.values()))
HALO_LEVELS = 5
"""A multiband blend carries coarse detail, here of a step by 100 grey levels, that far."""


def picture(seed):
    return np.random.default_rng(seed).integers(0, 256, SHAPE).astype(np.uint8)


def flat(level, shape=SHAPE):
    return np.full(shape, level, np.uint8)


@pytest.mark.parametrize('make', KINDS)
@pytest.mark.parametrize('channels', [np.s_[...], np.s_[..., 0]])
def test_equal_views_stay_as_they_are(make, channels):
    left = np.ascontiguousarray(picture(1)[channels])
    right = left.copy()
    make(EVERYWHERE, EVERYWHERE)(left, right)
    assert np.abs(right.astype(int) - picture(1)[channels]).max() <= 1


@pytest.mark.parametrize('make', KINDS)
def test_it_fades_from_the_left_to_the_right(make):
    right = flat(160)
    make(EVERYWHERE, EVERYWHERE)(flat(60), right)
    levels = right[:, :, 0].astype(int)
    assert (np.diff(levels, axis=1) >= -1).all()
    assert np.abs(np.diff(levels, axis=1)).max() < 8
    assert np.abs(levels[:, 0] - 60).max() <= 6
    assert np.abs(levels[:, -1] - 160).max() <= 6


@pytest.mark.parametrize('make', KINDS)
def test_what_one_shows_alone_is_taken_whole(make):
    left_seen, right_seen = EVERYWHERE.copy(), EVERYWHERE.copy()
    left_seen[:30], right_seen[60:] = False, False
    left, right = flat(60), flat(160)
    left[:30], right[60:] = 0, 0
    make(left_seen, right_seen)(left, right)
    assert np.abs(right[:24].astype(int) - 160).max() <= HALO_LEVELS
    assert np.abs(right[66:].astype(int) - 60).max() <= HALO_LEVELS


def test_a_multiband_blend_shows_fine_detail_of_one_view_only():
    stripes = flat(100)
    stripes[::2] = 120
    shifted = stripes[::-1].copy()
    contrasts = []
    for make in (Feather, Multiband):
        right = shifted.copy()
        make(EVERYWHERE, EVERYWHERE)(stripes.copy(), right)
        rows = right[20:70, :, 0].astype(int)
        contrasts.append(np.abs(np.diff(rows, axis=0)).mean(axis=0))
    feather, multiband = contrasts
    assert feather.mean() < 12
    assert np.median(multiband) > 18


@pytest.mark.parametrize('make', KINDS)
def test_a_strip_of_a_larger_picture_is_blended_in_place(make):
    panorama = flat(7, (90, 200, 3))
    make(EVERYWHERE, EVERYWHERE)(flat(60), panorama[:, 50:114])
    assert (panorama[:, :50] == 7).all()
    assert (panorama[:, 114:] == 7).all()
    assert panorama[:, 50:114].any()


@pytest.mark.parametrize('make', KINDS)
def test_narrow_strips_and_few_rows(make):
    for shape in ((90, 1), (1, 8), (3, 5)):
        seen = np.ones(shape, bool)
        right = flat(50, shape)
        make(seen, seen)(flat(50, shape), right)
        assert (right == 50).all()
