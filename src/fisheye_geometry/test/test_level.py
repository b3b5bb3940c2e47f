"""Levelling: which way is down, from symmetry, mounts or gravity."""

from math import nan

import numpy as np
import pytest

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude, angle_between
from fisheye_geometry.level import Mount, levelled

EXACT_DEG = 1e-6
NEARLY_DEG = 1.2
"""Mounts that differ by 2 degrees leave half of that, and a little for the yaw between them."""


def rig(*angles_deg):
    return [Attitude(*np.radians(angles)).matrix for angles in angles_deg]


def error_deg(found, truth):
    return max(np.degrees(angle_between(*pair)) for pair in zip(found, truth, strict=True))


def seen_from_the_first(attitudes):
    return [attitudes[0].T @ attitude for attitude in attitudes]


@pytest.mark.parametrize(
    'truth',
    [
        rig((-70, -12, 0), (70, -12, 0)),
        rig((-70, -5, 3), (70, -5, 3)),
        rig((-70, 25, 0), (70, 25, 0)),
        rig((-70, 0, 180), (70, 0, 180)),
        rig((-70, 0, 90), (70, 0, -90)),
        rig((-70, 0, 0), (70, 0, 180)),
        rig((-90, 2, 0), (90, 2, 0)),
        rig((-91, 2, 0), (91, 2, 0)),
        rig((-95, -2, 0), (0, 5, 0), (95, -2, 0)),
        rig((-20, -8, 0), (20, -8, 0)),
        rig((-120, -3, 0), (0, -3, 0), (120, -3, 0)),
        rig((-120, -3, 180), (0, -3, 180), (120, -3, 180)),
    ],
)
def test_cameras_that_pitch_and_roll_alike_are_levelled_without_being_told(truth):
    assert error_deg(levelled(seen_from_the_first(truth)), truth) < EXACT_DEG


def test_mounts_that_differ_share_the_difference():
    truth = rig((-70, -20, 0), (70, -18, 0))
    assert error_deg(levelled(seen_from_the_first(truth)), truth) < NEARLY_DEG


@pytest.mark.parametrize('roll_deg', [0, 180])
def test_a_ring_may_hang_upside_down(roll_deg):
    truth = rig(*((yaw, -5, roll_deg) for yaw in (-135, -45, 45, 135)))
    for is_closed in (False, True):
        found = levelled(seen_from_the_first(truth), is_closed=is_closed)
        assert error_deg(found, truth) < EXACT_DEG


def test_all_cameras_of_a_ring_vote():
    truth = rig((-135, -6, 1), (-45, -8, -2), (45, -5, 2), (135, -7, 0))
    found = levelled(seen_from_the_first(truth), is_closed=True)
    assert error_deg(found, truth) < 1.0


def test_gravity_and_the_first_camera_level_what_leans():
    lean = Attitude(*np.radians([0, 10, -6])).matrix
    truth = [lean @ attitude for attitude in rig((-70, 0, 0), (70, 0, 0))]
    seen = seen_from_the_first(truth)
    gravity = truth[0].T @ [0, 9.81, 0]
    down = [attitude.T @ [0, 1, 0] for attitude in levelled(seen, 'imu', gravity=gravity)]
    assert np.array(down) == pytest.approx(np.array([a.T @ [0, 1, 0] for a in truth]))
    first = levelled(seen, 'first')
    assert Attitude.of(first[0]).is_pure_yaw


def test_what_is_known_of_the_mounts_decides():
    truth = rig((-60, -10, 0), (80, 3, 0))
    mounts = [Mount(*np.radians([-60, -10, 0])), Mount()]
    assert error_deg(levelled(seen_from_the_first(truth), mounts=mounts), truth) < EXACT_DEG


def test_a_known_roll_says_which_way_up_cameras_are():
    truth = rig((-80, 0, 180), (80, 0, 180))
    mounts = [Mount(roll_rad=np.pi)] * 2
    assert error_deg(levelled(seen_from_the_first(truth), mounts=mounts), truth) < EXACT_DEG


def test_what_is_asked_on_top_comes_on_top():
    extra = Attitude(*np.radians([30, 5, -2]))
    truth = rig((-70, 0, 0), (70, 0, 0))
    expected = [extra.matrix @ attitude for attitude in truth]
    found = levelled(seen_from_the_first(truth), extra=extra)
    assert error_deg(found, expected) < EXACT_DEG
    assert np.array(levelled(truth, 'none')) == pytest.approx(np.array(truth))


def test_a_single_camera_is_level():
    (alone,) = levelled([Attitude(0.3, 0.2, 0.1).matrix])
    assert alone == pytest.approx(np.eye(3))


@pytest.mark.parametrize(
    ('how', 'words'), [('flat', "'flat' is not known; expected one of sym"), ('imu', 'gravity is')]
)
def test_impossible_levels_are_refused(how, words):
    with pytest.raises(GeometryError, match=words):
        levelled([np.eye(3)], how)


def test_a_mount_is_known_with_all_three_angles():
    assert Mount(0.0, 0.0, 0.0).is_known
    assert not Mount(0.0, nan, 0.0).is_known
