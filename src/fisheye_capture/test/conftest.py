"""What the tests of this package share."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from sensor_msgs.srv import SetCameraInfo

from fisheye_bridge.qos import IMAGE
from fisheye_capture.capture_node import CaptureNode
from fisheye_capture.capture_settings import CaptureSettings
from fisheye_testing.waiting import wait_for


@pytest.fixture
def wait_until():
    """Wait until a condition holds; fail when that takes too long."""
    return lambda condition, what: wait_for(condition, what=what)


@pytest.fixture
def settings():
    """Make the settings of a camera called left."""

    def make(source='synthetic', **changes):
        fast = {'frame_rate_hz': 200.0, 'source': str(source)}
        return replace(CaptureSettings(), **{**fast, **changes}).named('left')

    return make


@pytest.fixture
def write_picture(tmp_path):
    """Write a plain picture of a level of grey; give its path."""

    def write(name, level, width=32, height=24):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        cv2.imwrite(str(path), np.full((height, width, 3), level, np.uint8))
        return path

    return write


@pytest.fixture
def video(tmp_path):
    path = tmp_path / 'video.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 25, (32, 24))
    for level in (50, 100, 150):
        writer.write(np.full((24, 32, 3), level, np.uint8))
    writer.release()
    return path


class Ear(Node):
    """Keeps the last message of each topic of the camera called left."""

    def __init__(self, context):
        super().__init__('ear', context=context)
        self.heard, self.topics = {}, {}
        for kind, topic in (
            (Image, '/left/image_raw'),
            (CameraInfo, '/left/camera_info'),
            (DiagnosticArray, '/diagnostics'),
        ):
            self.listen(kind, topic)

    def listen(self, kind, topic):
        self.topics[topic] = self.create_subscription(
            kind, topic, lambda message: self.heard.update({topic: message}), IMAGE
        )


@pytest.fixture
def ros(wait_until):
    """Return `start`, which builds the node, and `hear`, which spins until a topic was heard."""

    class Ros:
        def __init__(self):
            self.context = rclpy.Context()
            rclpy.init(context=self.context)
            self.executor = SingleThreadedExecutor(context=self.context)
            self.ear = Ear(self.context)
            self.executor.add_node(self.ear)
            self.nodes = [self.ear]

        def start(self, namespace='/left', **parameters):
            node = CaptureNode(
                context=self.context,
                namespace=namespace,
                parameter_overrides=[
                    Parameter(name, value=value) for name, value in parameters.items()
                ],
            )
            self.nodes.append(node)
            self.executor.add_node(node)
            return node

        def spin_until(self, condition, what):
            def spun():
                self.executor.spin_once(timeout_sec=0.05)
                return condition()

            return wait_until(spun, what)

        def hear(self, topic):
            self.ear.heard.pop(topic, None)
            self.spin_until(lambda: topic in self.ear.heard, topic)
            return self.ear.heard[topic]

        def call(self, camera_info):
            client = self.ear.create_client(SetCameraInfo, '/left/set_camera_info')
            future = client.call_async(SetCameraInfo.Request(camera_info=camera_info))
            self.spin_until(future.done, 'the answer')
            return future.result()

    ros = Ros()
    yield ros
    for node in reversed(ros.nodes):
        node.destroy_node()
    rclpy.shutdown(context=ros.context)
