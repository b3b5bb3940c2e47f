"""How a panorama is turned against the level, while the robot nods."""

from dataclasses import replace

import numpy as np
import pytest
from test_rig_levels import SETTINGS, deg, rig_of, seen

from fisheye_geometry.attitude import Attitude, angle_between
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


def felt(level, nod, seconds):
    level.feel(ImuReading(round(seconds * 1e9), nod.matrix.T @ DOWN))


@pytest.mark.parametrize('extra', [{}, {'level_pitch_deg': 4.0, 'level_yaw_deg': 30.0}])
@pytest.mark.parametrize('laid', [deg(0, 0, 0), deg(0, 6, -3)])
def test_it_takes_rays_of_the_panorama_to_level_ones(measured, laid, extra):
    rig, images = measured
    settings = replace(IMU, **extra)
    level = LiveLevel(rig)
    rig.gravity = None
    felt(level, laid, 0.0)
    compositor = rig.compositor(settings, images)
    now = deg(0, -8, 5)
    for seconds in np.arange(0.01, 2.0, 0.01):
        felt(level, now if seconds > 1.5 else laid, seconds)
    overlaps = rig.effective_overlaps(settings)
    still = level.orientation(compositor, 10**9, overlaps, settings)
    assert np.degrees(angle_between(still.matrix, np.eye(3))) < CLOSE_DEG
    turn = level.orientation(compositor, round(1.95e9), overlaps, settings).matrix
    # Where the world's down is seen in the panorama, and where it has to be.
    extra_turn = rig.extra(settings).matrix
    drawn = compositor.views[0].attitude.matrix @ PAIR[0].matrix.T
    down = turn @ drawn @ now.matrix.T @ DOWN
    wanted = extra_turn @ DOWN
    assert np.degrees(np.arccos(down @ wanted)) < CLOSE_DEG
    assert compositor is rig_unchanged(level, compositor, overlaps, settings)


def rig_unchanged(level, compositor, overlaps, settings):
    """Return the compositor after many panoramas of a nod: none is built for them."""
    for step in range(100):
        felt(level, Attitude(pitch_rad=np.radians(10) * np.sin(step / 16)), 2.0 + step * 0.01)
        assert level.orientation(compositor, round((2.0 + step * 0.01) * 1e9), overlaps, settings)
    return compositor


def test_without_an_imu_nothing_is_told(measured):
    rig, images = measured
    level = LiveLevel(rig)
    compositor = rig.compositor(SETTINGS, images)
    overlaps = rig.effective_overlaps(SETTINGS)
    assert level.orientation(compositor, 0, overlaps, IMU) is None
    (sentence,) = level.faults()
    assert 'nothing came on the topic imu' in sentence
    felt(level, deg(0, 0, 0), 1.0)
    assert level.orientation(compositor, 0, overlaps, SETTINGS) is None


def test_a_nod_is_no_slope(measured):
    rig, _ = measured
    rig.gravity = None
    level = LiveLevel(rig)
    felt(level, deg(0, 0, 0), 0.0)
    news = [
        level.feel(ImuReading(round(t * 1e9), deg(0, 10 * np.sin(6.28 * t), 0).matrix.T @ DOWN))
        for t in np.arange(0.01, 3.0, 0.01)
    ]
    assert not any(news)


def test_an_imu_that_jumps_and_one_of_another_clock_are_told(measured):
    rig, images = measured
    rig.gravity = None
    level = LiveLevel(rig)
    felt(level, deg(0, 0, 0), 1.0)
    compositor = rig.compositor(IMU, images)
    overlaps = rig.effective_overlaps(IMU)
    level.orientation(compositor, 10**9, overlaps, IMU)
    assert level.faults() == []
    level.orientation(compositor, 61 * 10**9, overlaps, IMU)
    assert 'the stamps of the imu are 60 s behind those of the pictures' in level.faults()[0]
    felt(level, deg(0, 0, 90), 1.01)
    assert 'the imu jumped by 90 degrees from one message to the next' in level.faults()[0]
