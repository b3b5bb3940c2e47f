"""A consumer of the panorama: marks a bearing in each image, where the projection says that it is.

    python examples/mark_bearing.py --ros-args -p bearing_deg:=30.0

Subscribes to panorama/image and panorama/projection, publishes panorama/marked.
"""

from contextlib import suppress
from math import cos, radians, sin

import cv2
import rclpy
from fisheye_msgs.msg import Projection
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import Image

from fisheye_bridge.images import to_array
from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import IMAGE, IMAGE_INPUT, LATCHED

RED = {'rgb8': (255, 0, 0), 'bgr8': (0, 0, 255), 'mono8': 255}


class MarkBearing(Node):
    """Draws a vertical line through a bearing: degrees to the right of the panorama's middle."""

    def __init__(self):
        super().__init__('mark_bearing')
        bearing_rad = radians(self.declare_parameter('bearing_deg', 30.0).value)
        self._ray = sin(bearing_rad), 0.0, cos(bearing_rad)  # x right, y down, z ahead
        self._surface = None
        self._marked = self.create_publisher(Image, 'panorama/marked', IMAGE)
        self.create_subscription(Projection, 'panorama/projection', self._take_projection, LATCHED)
        self.create_subscription(Image, 'panorama/image', self._take_image, IMAGE_INPUT)

    def _take_projection(self, message):
        self._surface = surface_of(message)

    def _take_image(self, message):
        if self._surface is None or (message.width, message.height) != self._surface.size:
            return  # the projection of this image is still on its way
        (x_px, _), is_seen = self._surface.project(self._ray)
        image, encoding = to_array(message)  # the message's own memory
        if is_seen and -0.5 <= x_px < message.width - 0.5:
            at = round(x_px)
            cv2.line(image, (at, 0), (at, message.height - 1), RED[encoding])
        self._marked.publish(message)


if __name__ == '__main__':
    rclpy.init()
    with suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(MarkBearing())
