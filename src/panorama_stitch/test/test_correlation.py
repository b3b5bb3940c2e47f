import numpy as np
import pytest
from scenes import pair

from panorama_stitch.overlap.correlation import ScoreMap, correlate
from panorama_stitch.overlap.particles import facing_halves
from panorama_stitch.overlap.structure import face

RISE = range(-6, 7)


@pytest.fixture(scope='module')
def facing():
    views, surfaces, _ = pair()
    return face(*facing_halves(*views), surfaces[1], 0.0, px_per_deg=2.0)


def every_x(facing):
    width = facing.left.image.shape[1]
    return range(20 - width, width - 20)


def test_the_peak_is_at_the_true_offset(facing):
    _, surfaces, true_px = pair()
    landscape = correlate(facing, every_x(facing), RISE)
    half_start = surfaces[0].width - surfaces[0].width // 2
    x, y = landscape.peaks(1, apart_px=6)[0]
    assert x * facing.step == pytest.approx(true_px - half_start, abs=facing.step)
    assert y == 0
    assert landscape.score_at(x, y) > 0.6
    assert landscape.best_away_from(x, 6)[0] < 0.3


def test_is_what_summing_up_gives(facing):
    left, right = facing.left, facing.right
    x, y = 41, -3
    landscape = correlate(facing, [x], [y])
    theirs, mine = left.image[:y, x:], right.image[-y:, : left.image.shape[1] - x]
    seen = (left.valid[:y, x:] & right.valid[-y:, : left.image.shape[1] - x]) > 0
    energy = np.sqrt((mine[seen] ** 2).sum() * (theirs[seen] ** 2).sum())
    expected = (mine[seen] * theirs[seen]).sum() / energy - 6.0 / np.sqrt(energy)
    assert landscape.score_at(x, y) == pytest.approx(expected, abs=1e-3)


def test_a_slope_at_the_rim_is_no_peak():
    score = np.zeros((5, 40), np.float32)
    score[0, 10] = 0.9
    score[2, 30] = 0.5
    landscape = ScoreMap(np.arange(40), np.arange(5), score)
    assert landscape.peaks(3, apart_px=4) == [(30, 2)]


def test_peaks_are_apart():
    score = np.zeros((3, 40), np.float32)
    score[1, [10, 12, 25]] = 0.9, 0.8, 0.7
    landscape = ScoreMap(np.arange(40), np.arange(3), score)
    assert [x for x, _ in landscape.peaks(5, apart_px=4)] == [10, 25]
