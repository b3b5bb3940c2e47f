"""Pairing: right partners, whatever the order, and never more memory than agreed."""

import pytest

from panorama_stitch.pairing import FramePairing

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
    assert pairing.unpaired['left'] == 996


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
