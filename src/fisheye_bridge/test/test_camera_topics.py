"""A camera's topics: calibrations that are refused, freeze nothing, or change all the time."""

import time

import numpy as np
import pytest
import rclpy
from sensor_msgs.msg import CameraInfo
from std_msgs.msg import Header

from fisheye_bridge import camera_topics
from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import WARN, Report
from fisheye_core.errors import GeometryError

FRAME_S = 1 / 30
ODD = {'fx': 1938.0, 'fy': 213.0, 'd': [1.05, 1.76, 0.21, -0.62, 0.71], 'model': 'plumb_bob'}
QUIET = 20
"""How much longer than a frame a busy machine may take; it was more than 300."""


def camera_info(fx=215.0, fy=215.0, d=(0.0,) * 4, model='equidistant'):
    k = [fx, 0.0, 319.5, 0.0, fy, 239.5, 0.0, 0.0, 1.0]
    return CameraInfo(width=640, height=480, distortion_model=model, k=k, d=list(d))


@pytest.fixture
def node():
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('camera_topics', context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


@pytest.fixture
def camera(node):
    class Camera(CameraSubscription):
        lenses, checked, refuses = [], 0, False

        def __init__(self):
            super().__init__(
                node,
                on_picture=lambda *_: None,
                on_lens=lambda lens, _: self.lenses.append(lens),
                check=self._count,
            )

        def _count(self, lens):
            self.checked += 1
            if self.refuses:
                raise GeometryError('no surface')

        def show(self, message):
            self._take_camera_info(message)
            self._take_picture(np.full((480, 640, 3), 90, np.uint8), 'bgr8', Header())

        def told(self):
            report = Report()
            self.report(report, is_used=True)
            return report

    Camera.lenses = []
    return Camera()


def test_no_calibration_freezes_the_node(camera):
    begin = time.process_time()
    camera.show(camera_info(**ODD))
    assert time.process_time() - begin < QUIET * FRAME_S
    assert camera.lenses, 'it is a possible lens'


def test_a_calibration_that_was_refused_is_not_looked_at_again_at_once(camera, monkeypatch):
    monkeypatch.setattr(camera_topics, '_AGAIN_S', 60.0)
    camera.refuses = True
    for _ in range(30):
        camera.show(camera_info())
    assert camera.checked == 1
    assert 'camera_info refused: no surface' in camera.told().reasons[0]


def test_a_calibration_that_never_stays_is_followed_now_and_then(camera):
    for index in range(60):
        camera.show(camera_info(fx=215.0 + 0.01 * index))
    assert len(camera.lenses) == 3, 'the first ones at once'
    report = camera.told()
    assert report.level == WARN
    assert 'camera_info changes again and again; expected one calibration' in report.reasons[0]
    for _ in range(2):
        camera.show(camera_info(fx=215.02))
    assert camera.told().reasons == [], 'it stays now'
