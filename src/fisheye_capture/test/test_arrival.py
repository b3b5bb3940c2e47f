"""Times of arrival: as if the network had held nothing up."""

import pytest

from fisheye_capture.arrival import ArrivalClock

PERIOD_NS = 40_000_000
START_NS = 1_000_000_000_000
S_NS = 1_000_000_000


def test_pictures_that_come_regularly_keep_their_time():
    clock = ArrivalClock()
    for n in range(1000):
        arrival_ns = START_NS + n * PERIOD_NS
        assert clock.stamp_ns(n * PERIOD_NS, arrival_ns) == arrival_ns


def test_pictures_that_were_held_up_have_the_time_at_which_they_would_have_come():
    clock = ArrivalClock()
    for n in range(100):
        due_ns = START_NS + n * PERIOD_NS
        held_up_until_ns = START_NS + 80 * PERIOD_NS
        arrival_ns = max(due_ns, held_up_until_ns) if 50 < n < 80 else due_ns
        assert clock.stamp_ns(n * PERIOD_NS, arrival_ns) == due_ns


@pytest.mark.parametrize('drift', [1e-4, -1e-4])
def test_a_clock_that_is_wrong_is_followed(drift):
    clock = ArrivalClock()
    for n in range(10_000):
        arrival_ns = START_NS + n * PERIOD_NS
        stamp_ns = clock.stamp_ns(round(n * PERIOD_NS * (1 + drift)), arrival_ns)
        # The window is at most twice 5 s long.
        assert abs(stamp_ns - arrival_ns) <= 10 * S_NS * abs(drift) + PERIOD_NS * abs(drift)


def test_a_stream_that_begins_anew_is_believed():
    clock = ArrivalClock()
    clock.stamp_ns(500 * S_NS, START_NS)
    assert clock.stamp_ns(0, START_NS + S_NS) == START_NS + S_NS


def test_a_picture_without_a_time_came_when_it_came():
    assert ArrivalClock().stamp_ns(None, START_NS) == START_NS
