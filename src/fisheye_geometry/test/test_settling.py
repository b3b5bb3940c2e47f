"""Changes that never end are followed ever more rarely, and a single one at once."""

import pytest

from fisheye_geometry import settling
from fisheye_geometry.settling import Settling


@pytest.fixture
def clock(monkeypatch):
    class Clock:
        now_s = 100.0

    monkeypatch.setattr(settling, 'monotonic', lambda: Clock.now_s)
    return Clock


def test_what_changes_all_the_time_is_followed_ever_more_rarely(clock):
    settled, followed = Settling(), []
    for _ in range(30 * 60):
        if settled.follow():
            followed.append(clock.now_s - 100.0)
        clock.now_s += 1 / 30
    assert followed == pytest.approx([0, 1 / 30, 2 / 30, 5, 15, 35], abs=0.2)
    assert settled.waits


def test_rare_changes_are_followed_at_once(clock):
    settled = Settling()
    for _ in range(10):
        assert settled.follow()
        assert not settled.waits
        clock.now_s += 31.0


def test_calm_ends_the_waiting(clock):
    settled = Settling()
    assert [settled.follow() for _ in range(4)] == [True, True, True, False]
    assert settled.waits
    settled.calm()
    assert not settled.waits
