"""Pacing: the same grid of times for everybody, and no queue of what is late."""

import time
from threading import Thread

import pytest

from fisheye_capture import pace
from fisheye_capture.pace import Pace
from fisheye_capture.source import SourceEndedError

PERIOD_NS = 10_000_000
RATE_HZ = 100.0


class Clock:
    """A clock that goes on only while somebody waits."""

    def __init__(self, now_ns):
        self.now_ns = now_ns

    def time_ns(self):
        return self.now_ns

    def wait(self, timeout_s):
        self.now_ns += round(timeout_s * 1e9)
        return False


@pytest.fixture
def clock(monkeypatch):
    clock = Clock(1_700_000_000_003_000_000)
    monkeypatch.setattr(pace, 'time', clock)
    monkeypatch.setattr(pace, 'Event', lambda: clock)
    return clock


def test_stamps_lie_on_the_grid_of_the_epoch(clock):
    paced = Pace(RATE_HZ)
    stamps = [paced.wait() for _ in range(3)]
    assert stamps == [1_700_000_000_000_000_000 + n * PERIOD_NS for n in (1, 2, 3)]
    assert clock.now_ns == stamps[-1]


def test_cameras_that_start_at_different_times_share_the_grid(clock):
    first, second = Pace(RATE_HZ), Pace(RATE_HZ)
    stamp = first.wait()
    clock.now_ns += 4_000_000
    assert second.wait() == first.wait() == stamp + PERIOD_NS


def test_what_is_late_is_skipped_not_queued(clock):
    paced = Pace(RATE_HZ)
    stamp = paced.wait()
    clock.now_ns += 3 * PERIOD_NS + 2_000_000
    assert paced.wait() == stamp + 3 * PERIOD_NS
    assert paced.skipped == 2
    assert paced.wait() == stamp + 4 * PERIOD_NS


def test_a_clock_set_back_does_not_stop_it(clock):
    paced = Pace(RATE_HZ)
    stamp = paced.wait()
    clock.now_ns -= 3_600_000_000_000
    assert paced.wait() == stamp - 3_600_000_000_000 + PERIOD_NS


def test_a_wait_ends_when_interrupted():
    paced = Pace(0.1)
    ended = []

    def wait():
        with pytest.raises(SourceEndedError):
            paced.wait()
        ended.append(True)

    thread = Thread(target=wait)
    thread.start()
    paced.interrupt()
    thread.join(timeout=5)
    assert ended


def test_waiting_does_not_burn_a_core():
    paced = Pace(1000.0)
    cpu_s, began_s = time.thread_time(), time.monotonic()
    while time.monotonic() - began_s < 0.3:
        paced.wait()
    assert time.thread_time() - cpu_s < 0.5 * (time.monotonic() - began_s)
