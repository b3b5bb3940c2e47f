"""Which way is down, from an Imu."""

from math import cos, radians, sin

import numpy as np
import pytest
from sensor_msgs.msg import Imu

from fisheye_bridge.imu import gravity_of

G_M_S2 = 9.81


def test_a_level_robot_by_its_acceleration():
    message = Imu()
    message.orientation_covariance[0] = -1.0
    message.linear_acceleration.z = G_M_S2
    assert gravity_of(message) == pytest.approx([0, 1, 0])


def test_a_robot_that_looks_down_by_its_acceleration():
    message = Imu()
    message.orientation_covariance[0] = -1.0
    # Looking down, x ahead is partly down: what holds it up acts backwards too.
    message.linear_acceleration.x = -G_M_S2 * sin(radians(20))
    message.linear_acceleration.z = G_M_S2 * cos(radians(20))
    assert gravity_of(message) == pytest.approx([0, cos(radians(20)), sin(radians(20))])


def test_a_robot_that_looks_down_by_its_orientation():
    message = Imu()
    # REP-103: pitching down is a positive turn about y, which points to the left.
    message.orientation.y, message.orientation.w = sin(radians(10)), cos(radians(10))
    assert gravity_of(message) == pytest.approx([0, cos(radians(20)), sin(radians(20))])


@pytest.mark.parametrize('acceleration', [0.0, np.nan])
def test_what_says_nothing_is_not_taken(acceleration):
    message = Imu()
    message.orientation_covariance[0] = -1.0
    message.linear_acceleration.z = acceleration
    assert gravity_of(message) is None


def test_nothing_measured_is_not_taken():
    message = Imu()
    message.orientation_covariance[0] = message.linear_acceleration_covariance[0] = -1.0
    message.linear_acceleration.z = G_M_S2
    assert gravity_of(message) is None
