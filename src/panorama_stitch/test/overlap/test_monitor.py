"""Whether a seam still holds, told from one pair of frames a second."""

import numpy as np
import pytest
from seeing import apart_deg, see, turned, world

from panorama_stitch.overlap.monitor import SeamMonitor
from panorama_stitch.overlap.votes import pooled

YAW = 130.0
LEFT = turned(yaw=-YAW / 2)
IN_USE = turned(yaw=YAW)
RIGHT_DEG = 0.2
CLOSE_DEG = 0.1


def drive(moved, seconds=12, post=None):
    """States of a monitor while the right camera has moved by an attitude; what it then knows."""
    monitor, around = SeamMonitor(IN_USE), world(6)
    right = turned(yaw=YAW / 2) * moved
    states = []
    for second in range(seconds):
        place = None if post is None else post(second)
        left_view = see(around, LEFT, (-0.05, 0.0, 0.0), place, seed=2 * second)
        right_view = see(around, right, (0.05, 0.0, 0.0), place, seed=2 * second + 1)
        states.append(monitor.look(left_view, right_view, float(second)))
    return states, monitor


@pytest.mark.parametrize('moved', [turned(yaw=0.7), turned(pitch=-0.8), turned(yaw=2.0, roll=1.0)])
def test_a_mount_that_moved_is_told(moved):
    states, _ = drive(moved)
    truth = np.degrees(moved.magnitude())
    assert states[-1].drifted
    assert states[-1].drift_deg == pytest.approx(truth, abs=RIGHT_DEG)
    assert not states[4].drifted  # not before ten seconds


def test_a_slight_move_is_not_told():
    states, _ = drive(turned(yaw=0.3))
    assert not any(state.drifted for state in states)
    assert states[-1].drift_deg == pytest.approx(0.3, abs=RIGHT_DEG)


def test_a_person_who_crosses_is_no_drift():
    states, _ = drive(turned(), post=lambda second: (0.3 * (second - 6), 1.2, 0.2))
    assert not any(state.drifted for state in states)


def test_the_quality_falls_with_what_is_out_of_place():
    good, bad = drive(turned(), 1)[0][0], drive(turned(yaw=1.5), 1)[0][0]
    assert good.quality > 0.9
    assert bad.quality < 0.3


def test_time_sharpens_the_rotation():
    moved = turned(yaw=0.3, pitch=0.2)
    _, monitor = drive(moved, 6)
    rotation, covariance = monitor.sharpened()
    assert apart_deg(rotation, IN_USE * moved) < CLOSE_DEG
    assert np.sqrt(np.trace(covariance)) < np.radians(CLOSE_DEG)


def test_nothing_seen_tells_nothing():
    assert SeamMonitor(IN_USE).sharpened() is None
    dark = see(world(6) * 0, LEFT)
    state = SeamMonitor(IN_USE).look(dark, dark, 0.0)
    assert np.isnan(state.drift_deg)
    assert not state.drifted


def test_a_look_from_another_thread_meanwhile_does_no_harm(monkeypatch):
    _, monitor = drive(turned(), 2)

    around = world(6)
    views = see(around, LEFT), see(around, turned(yaw=YAW / 2))

    def while_another_looks(votes):
        seen = []
        for one in votes:
            seen.append(one)
            monitor.look(*views, 2.0)
        return pooled(seen)

    monkeypatch.setattr('panorama_stitch.overlap.monitor.pooled', while_another_looks)
    rotation, _ = monitor.sharpened()
    assert apart_deg(rotation, IN_USE) < CLOSE_DEG
