"""How a panorama is turned against the level, while the robot nods."""

from dataclasses import replace

import numpy as np
import pytest
from test_rig_levels import SETTINGS, deg, rig_of, seen

from fisheye_geometry.attitude import angle_between
from fisheye_geometry.inertial import ImuReading
from panorama_stitch.pipeline.live_level import LiveLevel
from panorama_stitch.pipeline.rig_measurement import measure_overlaps

DOWN = np.array([0.0, 1.0, 0.0])
IMU = replace(SETTINGS, level='imu')
PAIR = deg(-70, 0, 0), deg(70, 0, 0)
CLOSE_DEG = 0.3


@pytest.fixture(scope='module')
def measured():
    images = seen(*PAIR)
    rig = rig_of(2)
    rig.overlaps = measure_overlaps(rig, [images], SETTINGS, 'particles')
    return rig, images


class Robot:
    """A robot with an IMU, and with the time of its own."""

    def __init__(self, rig):
        rig.gravity = None
        self.now_s = 0.0
        self.level = LiveLevel(rig, clock=lambda: self.now_s)

    def feel(self, nod, seconds):
        self.now_s = float(seconds)
        return self.level.feel(ImuReading(round(seconds * 1e9), nod.matrix.T @ DOWN))

    def drive(self, begin_s, end_s, nod):
        """Feel what `nod` gives at each time; return how often the gravity was another one."""
        return sum(self.feel(nod(t), t) for t in np.arange(begin_s, end_s, 0.01))


@pytest.mark.parametrize('extra', [{}, {'level_pitch_deg': 4.0, 'level_yaw_deg': 30.0}])
@pytest.mark.parametrize('laid', [deg(0, 0, 0), deg(0, 6, -3)])
def test_it_takes_rays_of_the_panorama_to_level_ones(measured, laid, extra):
    rig, images = measured
    settings = replace(IMU, **extra)
    robot = Robot(rig)
    assert robot.drive(0, 1.2, lambda _: laid) == 1
    compositor = rig.compositor(settings, images)
    now = deg(0, -8, 5)
    robot.drive(1.2, 1.5, lambda _: laid)
    robot.drive(1.5, 2.0, lambda _: now)
    still = robot.level.orientation(compositor, 10**9, settings)
    assert np.degrees(angle_between(still.matrix, np.eye(3))) < CLOSE_DEG
    turn = robot.level.orientation(compositor, round(1.95e9), settings).matrix
    # Where the world's down is seen in the panorama, and where it has to be.
    drawn = compositor.views[0].attitude.matrix @ PAIR[0].matrix.T
    down = turn @ drawn @ now.matrix.T @ DOWN
    assert np.degrees(np.arccos(down @ rig.extra(settings).matrix @ DOWN)) < CLOSE_DEG


def test_without_an_imu_nothing_is_told(measured):
    rig, images = measured
    robot = Robot(rig)
    compositor = rig.compositor(SETTINGS, images)
    assert robot.level.orientation(compositor, 0, IMU) is None
    (sentence,) = robot.level.faults()
    assert 'nothing came on the topic imu' in sentence
    robot.feel(deg(0, 0, 0), 1.0)
    assert robot.level.orientation(compositor, 0, SETTINGS) is None


def test_a_nod_is_no_slope_and_a_slope_is_one(measured):
    robot = Robot(measured[0])
    nod = lambda t: deg(0, 10 * np.sin(2 * np.pi * t), 0)  # noqa: E731
    assert robot.drive(0, 20, nod) == 1, 'at the start, and no table is built after that'
    assert robot.drive(20, 60, lambda t: deg(0, 12 + 10 * np.sin(2 * np.pi * t), 0)) > 1
    assert np.degrees(np.arccos(robot.level.rig.gravity @ (deg(0, 12, 0).matrix.T @ DOWN))) < 4


def test_an_imu_that_jumps_stops_or_has_another_clock_is_told(measured):
    rig, images = measured
    robot = Robot(rig)
    robot.feel(deg(0, 0, 0), 1.0)
    compositor = rig.compositor(IMU, images)
    level = robot.level
    level.orientation(compositor, 10**9, IMU)
    assert level.faults() == []
    held = level.orientation(compositor, 61 * 10**9, IMU)
    assert np.degrees(angle_between(held.matrix, np.eye(3))) < CLOSE_DEG
    assert 'the stamps of the imu are 60 s behind those of the pictures' in level.faults()[0]
    robot.feel(deg(0, 0, 90), 1.01)
    assert 'the imu jumped by 90 degrees from one message to the next' in level.faults()[0]
    robot.now_s = 9.0
    assert 'nothing came on the topic imu for 8 s; the last level is held' in level.faults()[0]
