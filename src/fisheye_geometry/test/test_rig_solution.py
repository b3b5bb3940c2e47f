"""Solving a rig: measured rotations, mounts in their place, and pairs of unknown rotation."""

import numpy as np
import pytest

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude, angle_between
from fisheye_geometry.lens import make_lens
from fisheye_geometry.level import Mount
from fisheye_geometry.rig_solution import solve_rig

LENS = make_lens('plumb_bob', 100, 80, [80, 0, 49.5, 0, 80, 39.5, 0, 0, 1], [])
PAIR = [(name, LENS) for name in ('left', 'right')]
RING = [(name, LENS) for name in ('a', 'b', 'c', 'd')]
EXACT_DEG = 1e-6


def attitudes(*angles_deg):
    return [Attitude(*np.radians(angles)).matrix for angles in angles_deg]


def error_deg(rig, truth):
    found = [camera.attitude.matrix for camera in rig.cameras]
    return max(np.degrees(angle_between(*pair)) for pair in zip(found, truth, strict=True))


def test_a_measured_pair_is_levelled():
    truth = attitudes((-70, -15, 0), (70, -15, 0))
    solution = solve_rig(PAIR, [truth[0].T @ truth[1]])
    rig = solution.rig
    assert error_deg(rig, truth) < EXACT_DEG
    assert (rig.is_closed, rig.apart, solution.messages) == (False, (), ())
    assert np.degrees(rig.yaw_between(rig.pairs[0])) == pytest.approx(140)
    assert rig.relative(rig.pairs[0]).matrix == pytest.approx(truth[0].T @ truth[1])


def test_a_ring_is_closed_and_says_by_how_much_it_missed():
    truth = attitudes(*((yaw, -5, 0) for yaw in (-135, -45, 45, 135)))
    rotations = [truth[i].T @ truth[(i + 1) % 4] for i in range(4)]
    solution = solve_rig(RING, rotations[:-1], closing=rotations[-1])
    assert solution.rig.is_closed
    assert len(solution.rig.pairs) == 4
    assert error_deg(solution.rig, truth) < EXACT_DEG
    assert 'missed by 0.00 degrees' in solution.messages[0]


def test_known_mounts_stand_in_for_an_overlap_that_was_not_found():
    mounts = [Mount(*np.radians(angles)) for angles in ((-60, -10, 0), (80, -10, 0))]
    solution = solve_rig(PAIR, [None], mounts=mounts)
    assert error_deg(solution.rig, [mount.attitude.matrix for mount in mounts]) < EXACT_DEG
    assert solution.rig.apart == ()
    assert (
        'no overlap of left and right was found; they are drawn as yaw_deg'
        in (solution.messages[0])
    )


def test_a_pair_of_which_nothing_is_known_is_apart():
    rig = solve_rig(PAIR, [None], mounts=[Mount(), Mount(1.0, 0.0, 0.0)]).rig
    assert rig.apart == (0,)
    assert all(camera.attitude == Attitude() for camera in rig.cameras)


def test_numbers_that_do_not_belong_together_are_refused():
    with pytest.raises(GeometryError, match='2 rotations and 2 mounts for 2 cameras'):
        solve_rig(PAIR, [None, None])
