"""Votes of patches that lie elsewhere by a known shift, and of what repeats itself."""

import cv2
import numpy as np
import pytest

from panorama_stitch.overlap.patches import cast_votes
from panorama_stitch.overlap.strips import Strip, Strips, seam_frame

DENSITY = 70.0
REACH = np.radians((-7.0, 9.0)), np.radians(2.5)
SHIFT_PX = 3


def strips(picture) -> Strips:
    """The same picture twice, the left one further right."""
    rng = np.random.default_rng(0)
    sides = [
        Strip((one + rng.normal(0, 1, one.shape)).astype(np.float32), np.ones(one.shape, np.uint8))
        for one in (np.roll(picture, SHIFT_PX, axis=1), picture)
    ]
    height, width = picture.shape
    u, v = ((np.arange(count) - count / 2) / DENSITY for count in (width, height))
    return Strips(*sides, seam_frame(np.eye(3)), u, v, DENSITY)


def blotches(height=60, width=60):
    noise = np.random.default_rng(1).normal(0, 1, (height, width)).astype(np.float32)
    return 128 + 200 * cv2.GaussianBlur(noise, (0, 0), 1.5)


def slats(height=60, width=60, period=6):
    return 128 + 60.0 * (np.arange(width) % period < period / 2) * np.ones((height, 1))


def test_each_patch_of_a_distinct_scene_votes_for_its_shift():
    votes = cast_votes(strips(blotches()), *REACH)
    moved = np.sum((votes.left - votes.right) * votes.along, axis=1) * DENSITY
    assert np.median(moved) == pytest.approx(SHIFT_PX, abs=0.2)
    assert votes.weight.sum() > 0.7 * votes.textured


def test_what_repeats_itself_has_no_vote():
    votes = cast_votes(strips(slats()), *REACH)
    assert votes.weight.sum() < 0.3 * votes.textured
