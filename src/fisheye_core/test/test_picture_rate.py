"""The nominal rate: left only where pictures come clearly faster or slower."""

import numpy as np
import pytest

from fisheye_core.picture_rate import PictureRate

TOLERANCE = 1.15
"""Within it a nominal rate is kept."""


def rates(hz_by_s, seconds, jitter=0.0):
    """Count pictures at the rates of each second; return the rate after each second."""
    rng, rate, now_s, result = np.random.default_rng(2), PictureRate(30.0), 0.0, []
    for second in range(seconds):
        hz = hz_by_s[min(second, len(hz_by_s) - 1)]
        while now_s < second + 1:
            now_s += 1 / hz
            rate.changed(now_s + jitter * rng.uniform(-1, 1) / hz)
        result.append(rate.hz)
    return result


def test_what_is_as_usual_changes_nothing():
    assert rates([30.0], 5, jitter=0.3) == [30.0] * 5


@pytest.mark.parametrize('hz', [5.0, 10.0, 60.0, 200.0])
def test_another_rate_is_found(hz):
    assert rates([hz], 4)[-1] == pytest.approx(hz, rel=TOLERANCE - 1)


@pytest.mark.parametrize('hz', [0.1, 1.0])
def test_the_rate_of_slow_pictures_is_found(hz):
    assert rates([hz], round(13 / hz))[-1] == pytest.approx(hz, rel=TOLERANCE - 1)
    assert rates([hz], round(40 / hz), jitter=0.3)[-1] == pytest.approx(hz, rel=0.5)


def test_a_jump_is_followed_within_a_second():
    after = rates([10.0, 10.0, 10.0, 60.0], 4)
    assert after[2] == pytest.approx(10.0, rel=TOLERANCE - 1)
    assert after[3] == pytest.approx(60.0, rel=TOLERANCE - 1)


def test_a_pause_is_no_rate():
    rate = PictureRate(30.0)
    times_s = [n / 30 for n in range(20)] + [5 + n / 30 for n in range(20)]
    assert not any(rate.changed(now_s) for now_s in times_s)
