import numpy as np
import pytest
from scenes import exposed, pair

from panorama_stitch.overlap.correlation import ScoreMap, correlate
from panorama_stitch.overlap.particles import facing_halves
from panorama_stitch.overlap.proposals import propose
from panorama_stitch.overlap.structure import face


def facing_pair(views, surfaces):
    return face(*facing_halves(*views), surfaces[1], 0.0, px_per_deg=2.0)


def landscape_of(facing):
    width = facing.left.image.shape[1]
    return correlate(facing, range(20 - width, width - 20), range(-9, 10))


def test_particles_propose_the_true_offset_whatever_the_exposure():
    (left, right), surfaces, true_px = pair()
    facing = facing_pair((left, exposed(right, 0.7, noise=5)), surfaces)
    proposals = propose(facing, max_rise_px=8)
    offsets = proposals.offsets(landscape_of(facing), 8)
    expected = (true_px - surfaces[0].width + surfaces[0].width // 2) / facing.step
    assert min(abs(x - expected) for x, _ in offsets) <= 1

    n, m = proposals.match_at(expected, 0)
    shift = proposals.left[n, :2] - proposals.right[m, :2]
    assert shift == pytest.approx([expected, 0], abs=3)
    assert proposals.match_at(expected + 1000, 0) == (-1, -1)


def test_scaled_particles_are_in_px_of_the_picture():
    views, surfaces, _ = pair()
    facing = facing_pair(views, surfaces)
    proposals = propose(facing, max_rise_px=8)
    large = proposals.scaled(facing.step)
    assert large.left[:, 8] == pytest.approx(proposals.left[:, 8] * facing.step**2)
    assert large.shifts == pytest.approx(proposals.shifts * facing.step)
    assert large.left[:, 6].max() <= views[0].shape[1] / 2 + facing.step


def test_flat_pictures_propose_nothing():
    (left, right), surfaces, _ = pair()
    flat = tuple(np.where(view > 0, 128, 0).astype(np.uint8) for view in (left, right))
    proposals = propose(facing_pair(flat, surfaces), max_rise_px=8)
    empty = ScoreMap(np.arange(9), np.arange(5), np.zeros((5, 9), np.float32))
    assert proposals.offsets(empty, 8) == []
    assert proposals.match_at(0, 0) == (-1, -1)
