"""Where views look, as tf2 hears it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from geometry_msgs.msg import Vector3Stamped
from sensor_msgs.msg import CameraInfo

from fisheye_geometry.attitude import Attitude, angle_between, attitude_of
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for

START_S = 60.0
EXACT_DEG = 1e-3


@pytest.fixture
def rig(domain, tmp_path, interfaces):
    with RigProcesses(domain, tmp_path / 'log', interfaces) as rig:
        yield rig


@pytest.fixture
def heard(domain, interfaces):
    """Return a function that gives the transforms of the next messages of a topic."""

    def listen(topic, count=1):
        done = subprocess.run(
            [sys.executable, Path(__file__).with_name('tf_listener.py'), topic, str(count)],
            env={**os.environ, **interfaces, 'ROS_DOMAIN_ID': str(domain)},
            capture_output=True,
            text=True,
            timeout=START_S,
            check=True,
        )
        return [json.loads(line) for line in done.stdout.splitlines()]

    return listen


def off_deg(transform, *angles_deg):
    wanted = Attitude(*np.radians(angles_deg)).matrix
    return np.degrees(angle_between(attitude_of(*transform['rotation']).matrix, wanted))


def test_views_have_their_place_in_the_rig(rig, watcher, heard):
    rig.start('panorama', views='[front, rear]', **{'front.pitch_deg': -12.0})
    (transforms,) = heard('/tf_static')
    front, rear = transforms
    assert [each['child'] for each in transforms] == ['front_optical_frame', 'rear_optical_frame']
    assert {each['parent'] for each in transforms} == {'panorama_optical_frame'}
    assert off_deg(front, 0, -12) < EXACT_DEG
    assert off_deg(rear, 180, 0) < EXACT_DEG
    look = watcher.node.create_publisher(Vector3Stamped, 'front/look', 1)
    infos = []
    watcher.node.create_subscription(CameraInfo, 'front/camera_info', infos.append, 5)
    wait_for(look.get_subscription_count, START_S, 'who hears')
    message = Vector3Stamped()
    message.vector.x, message.vector.y = 0.5, 0.0
    look.publish(message)
    wait_for(lambda: rig.check_alive() or infos, START_S, 'camera_info')
    moved = heard('/tf', 5)
    assert {each['child'] for (each,) in moved} == {'front_optical_frame'}
    stamps = [each['stamp_ns'] for (each,) in moved]
    assert stamps == sorted(set(stamps))

    def is_there():
        return off_deg(heard('/tf', 1)[0][0], np.degrees(0.5), 0) < EXACT_DEG

    wait_for(is_there, START_S, 'the end of its turn')
