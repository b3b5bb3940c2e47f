"""Which way is down, from an Imu."""

from math import cos, radians, sin

import numpy as np
import pytest
from sensor_msgs.msg import Imu

from fisheye_bridge.imu import reading_of

G_M_S2 = 9.81


def test_a_level_robot_by_its_acceleration():
    message = Imu()
    message.orientation_covariance[0] = -1.0
    message.linear_acceleration.z = G_M_S2
    assert reading_of(message).down == pytest.approx([0, 1, 0])


def test_a_robot_that_looks_down_by_its_acceleration():
    message = Imu()
    message.orientation_covariance[0] = -1.0
    # Looking down, x ahead is partly down: what holds it up acts backwards too.
    message.linear_acceleration.x = -G_M_S2 * sin(radians(20))
    message.linear_acceleration.z = G_M_S2 * cos(radians(20))
    assert reading_of(message).down == pytest.approx([0, cos(radians(20)), sin(radians(20))])


def test_a_robot_that_looks_down_by_its_orientation():
    message = Imu()
    # REP-103: pitching down is a positive turn about y, which points to the left.
    message.orientation.y, message.orientation.w = sin(radians(10)), cos(radians(10))
    assert reading_of(message).down == pytest.approx([0, cos(radians(20)), sin(radians(20))])


@pytest.mark.parametrize('acceleration', [0.0, np.nan])
def test_what_says_nothing_is_not_taken(acceleration):
    message = Imu()
    message.orientation_covariance[0] = -1.0
    message.linear_acceleration.z = acceleration
    assert reading_of(message) is None


def test_nothing_measured_is_not_taken():
    message = Imu()
    message.orientation_covariance[0] = message.linear_acceleration_covariance[0] = -1.0
    message.linear_acceleration.z = G_M_S2
    assert reading_of(message) is None


def test_a_turn_is_told_in_the_frame_of_a_camera_that_looks_ahead():
    message = Imu()
    message.linear_acceleration.z = G_M_S2
    # REP-103: x ahead, y left, z up; x right, y down, z ahead.
    rate = message.angular_velocity
    rate.x, rate.y, rate.z = 1.0, 2.0, 3.0
    message.orientation_covariance[0] = -1.0
    reading = reading_of(message)
    assert reading.turn_rad_s == pytest.approx([-2, -3, 1])
    assert not reading.is_fused
    assert reading.acceleration == pytest.approx(G_M_S2)
    rate.x = np.nan
    assert reading_of(message).turn_rad_s is None
