"""Pairing: right partners, whatever the order, and never more memory than agreed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from panorama_stitch.pipeline.pairing import FramePairing

MS = 1_000_000
PERIOD = 33 * MS


def stamps(group):
    return [member.stamp_ns // MS for member in group]


def pair_all(arrivals, max_skew_ms=50, cameras=('left', 'right')):
    pairing = FramePairing(cameras, max_skew_ms * MS)
    groups = [pairing.add(camera, stamp, None) for camera, stamp in arrivals]
    return pairing, [stamps(group) for group in groups if group]


def test_equal_stamps_pair_in_any_order():
    _, groups = pair_all(
        [
            ('left', 0),
            ('right', 0),
            ('right', PERIOD),
            ('left', PERIOD),
            ('left', 2 * PERIOD),
            ('left', 3 * PERIOD),
            ('right', 2 * PERIOD),
            ('right', 3 * PERIOD),
        ]
    )
    assert groups == [[0, 0], [33, 33], [66, 66], [99, 99]]


def test_a_constant_phase_pairs_every_frame():
    arrivals = sorted(
        [('left', k * PERIOD) for k in range(20)]
        + [('right', k * PERIOD + 12 * MS) for k in range(20)],
        key=lambda entry: entry[1],
    )
    pairing, groups = pair_all(arrivals)
    assert all(right - left == 12 for left, right in groups)
    assert len(groups) == 20
    assert pairing.unpaired == {'left': 0, 'right': 0}
    assert max(pairing.skews_ns) == 12 * MS


def test_after_a_lost_frame_the_right_partners_are_found_again():
    arrivals = []
    for k in range(12):
        if k != 5:
            arrivals.append(('left', k * PERIOD))
        arrivals.append(('right', k * PERIOD))
    pairing, groups = pair_all(arrivals)
    assert [group for group in groups if group[0] != group[1]] == []
    assert len(groups) == 11
    assert pairing.unpaired == {'left': 0, 'right': 1}


def test_frames_too_far_apart_are_no_pair():
    pairing, groups = pair_all([('left', 0), ('right', 60 * MS), ('left', 61 * MS)])
    assert groups == [[61, 60]]
    assert pairing.unpaired['left'] == 1


def test_a_silent_camera_costs_no_memory():
    pairing, groups = pair_all([('left', k * PERIOD) for k in range(1000)])
    assert groups == []
    assert pairing.unpaired['left'] == 992


def test_it_goes_on_after_the_clock_jumped_back():
    loop = [(camera, k * PERIOD) for k in range(100, 110) for camera in ('left', 'right')]
    _, groups = pair_all([*loop, *loop, *loop])
    assert len(groups) == 30


def test_a_stamp_from_the_future_does_no_lasting_harm():
    loop = [(camera, k * PERIOD) for k in range(10) for camera in ('left', 'right')]
    _, groups = pair_all([('left', 10**18), *loop])
    assert len(groups) == 10


def test_repeated_stamps_pair_once():
    _, groups = pair_all([('left', 0), ('left', 0), ('right', 0), ('right', 0)])
    assert groups == [[0, 0]]


@pytest.mark.parametrize('cameras', [('left', 'middle', 'right'), ('a', 'b', 'c', 'd')])
def test_more_cameras_than_two(cameras):
    arrivals = [(camera, k * PERIOD + i) for k in range(10) for i, camera in enumerate(cameras)]
    _, groups = pair_all(arrivals, cameras=cameras)
    assert groups == [[33 * k] * len(cameras) for k in range(10)]


def test_how_far_the_clocks_are_apart_is_known():
    pairing, groups = pair_all([('left', 0)])
    assert pairing.spread_ns == 0
    pairing, groups = pair_all([('left', 0), ('right', 700 * MS), ('left', PERIOD)])
    assert pairing.spread_ns == 700 * MS - PERIOD
    assert not groups


def test_what_was_passed_over_is_not_paired_but_tells_how_late_it_came():
    pairing = FramePairing(('left', 'right'), 50 * MS)
    for k in range(10):
        pairing.add('left', k * PERIOD, None)
    pairing.pass_over(9 * PERIOD)
    for k in range(7, 10):
        assert pairing.add('right', k * PERIOD, None) is None
    assert pairing.lag_ns == PERIOD
    assert pairing.unpaired == {'left': 10, 'right': 3}
    assert pairing.add('left', 10 * PERIOD, None) is None
    assert stamps(pairing.add('right', 10 * PERIOD, None)) == [330, 330]


def waiting(pairing, camera):
    """How many frames of a camera wait: those that are dropped at once."""
    before = pairing.unpaired[camera]
    pairing.clear()
    return pairing.unpaired[camera] - before


@pytest.mark.parametrize(('late_s', 'frames'), [(0, 8), (1, 33), (2.9, 91), (4, 8), (37, 8)])
def test_frames_wait_as_long_as_a_camera_is_late_up_to_3_s(late_s, frames):
    pairing = FramePairing(('left', 'right'), 50 * MS)
    for k in range(200):
        pairing.add('left', k * PERIOD, None)
        pairing.add('right', k * PERIOD - round(late_s * 1000) * MS, None)
    for k in range(200, 300):
        pairing.add('left', k * PERIOD, None)
    assert waiting(pairing, 'left') == pytest.approx(frames, abs=1)


def test_who_waited_for_a_camera_that_died_lets_go():
    pairing = FramePairing(('left', 'right'), 50 * MS)
    for k in range(200):
        pairing.add('left', k * PERIOD, None)
        pairing.add('right', (k - 60) * PERIOD, None)
    for k in range(200, 600):
        pairing.add('left', k * PERIOD, None)
    assert waiting(pairing, 'left') == 8


@pytest.mark.parametrize(('late', 'is_full'), [(20, False), (40, True)])
def test_what_waits_has_bounded_room(late, is_full):
    pairing, groups = FramePairing(('left', 'right'), 50 * MS), 0
    for k in range(300):
        pairing.add('left', k * PERIOD, None, 10_000_000)
        groups += bool(pairing.add('right', (k - late) * PERIOD, None, 10_000_000))
    assert pairing.is_full == is_full
    assert bool(groups) != is_full
    assert pairing.late_and_early == ('right', 'left')
    assert waiting(pairing, 'left') <= 30


@given(
    st.lists(st.tuples(st.integers(0, 2), st.integers(-50, 200)), max_size=200),
    st.integers(1, 100),
)
def test_whatever_comes_a_frame_is_used_once_and_in_order(steps, max_skew_ms):
    pairing = FramePairing(('a', 'b', 'c'), max_skew_ms * MS)
    stamps_ns, used = [0, 0, 0], [set(), set(), set()]
    for number, (index, step_ms) in enumerate(steps):
        stamps_ns[index] += step_ms * MS
        group = pairing.add('abc'[index], stamps_ns[index], number)
        if group:
            taken = [member.stamp_ns for member in group]
            assert max(taken) - min(taken) <= max_skew_ms * MS
            for seen, member in zip(used, group, strict=True):
                assert member.frame not in seen
                seen.add(member.frame)


@pytest.mark.parametrize('rates', [(30, 15), (15, 30)])
def test_a_rate_that_changes_is_followed(rates):
    left, right, now = [], [], 0.0
    for rate in rates:
        for _ in range(3 * rate):
            now += 1000 / rate
            left.append(('left', round(now * MS)))
            right.append(('right', round((now + 500 / rate) * MS)))
    _, groups = pair_all(sorted(left + right, key=lambda entry: entry[1]))
    assert len(groups) >= len(left) - 3
