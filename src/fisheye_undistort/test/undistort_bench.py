"""The undistort node between a publisher and subscribers, for its tests."""

import time

import numpy as np
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from fisheye_msgs.msg import Projection
from rclpy.executors import SingleThreadedExecutor
from rclpy.parameter import Parameter
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_geometry.camera_file import Camera
from fisheye_geometry.lens import make_lens
from fisheye_testing.image_message import to_message
from fisheye_testing.waiting import wait_for
from fisheye_undistort.undistort_node import UndistortNode

DEADLINE_S = 10.0
LENS = make_lens('equidistant', 160, 120, [54, 0, 79.5, 0, 54, 59.5, 0, 0, 1], [0, 0, 0, 0])
PICTURE = np.full((120, 160, 3), 200, np.uint8)


class Bench:
    """The node between a publisher and subscribers, spun by hand."""

    def __init__(self, name, qos=IMAGE, **parameters):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        overrides = [Parameter(key, value=value) for key, value in parameters.items()]
        common = {'context': self._context, 'namespace': f'/{name}'}
        self.node = UndistortNode(parameter_overrides=overrides, **common)
        self._tester = rclpy.create_node('tester', **common)
        self.pictures, self.projections, self._stamp = [], [], 0
        self._raw = self._tester.create_publisher(Image, 'image_raw', qos)
        self._info = self._tester.create_publisher(CameraInfo, 'camera_info', qos)
        self._tester.create_subscription(Image, 'image_rect', self.pictures.append, IMAGE)
        self._tester.create_subscription(
            Projection, 'projection', self.projections.append, LATCHED
        )
        self._statuses = []
        self._tester.create_subscription(DiagnosticArray, '/diagnostics', self._take_status, 10)
        self._executor = SingleThreadedExecutor(context=self._context)
        for node in (self.node, self._tester):
            self._executor.add_node(node)

    def send(self, picture=PICTURE, encoding='bgr8', lens=LENS, **wrong):
        self._stamp += 1
        header = Header(frame_id='left_optical_frame')
        header.stamp.nanosec = self._stamp
        if lens is not None:
            info = camera_info_of(Camera('left', lens), header)
            for key, value in wrong.items():
                setattr(info, key, value)
            self._info.publish(info)
        if picture is None:
            return
        message = to_message(picture, 'bgr8' if picture.ndim == 3 else 'mono8', header)
        message.encoding = encoding
        self._raw.publish(message)

    def until(self, condition, what, **sending):
        deadline = time.monotonic() + DEADLINE_S
        while not condition():
            assert time.monotonic() < deadline, what
            self.send(**sending)
            for _ in range(6):
                self._executor.spin_once(timeout_sec=0.01)

    def told(self):
        """Return what the node warns of in its diagnostics."""
        status = self.status()
        return '' if status.level == DiagnosticStatus.OK else status.message

    def status(self):
        """Return the node's next diagnostics."""
        self._statuses.clear()
        wait_for(
            lambda: self._executor.spin_once(timeout_sec=0.01) or self._statuses,
            what='diagnostics',
        )
        return self._statuses[0]

    def refused(self):
        """Return how many pictures were refused."""
        values = {entry.key: entry.value for entry in self.status().values}
        return int(values['pictures refused'])

    def _take_status(self, message):
        self._statuses += [
            s for s in message.status if s.hardware_id == self.node.get_fully_qualified_name()
        ]

    def close(self):
        self._executor.shutdown()
        self.node.destroy_node()
        self._tester.destroy_node()
        rclpy.shutdown(context=self._context)
