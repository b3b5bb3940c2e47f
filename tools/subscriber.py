"""A subscriber as a process of its own: a line with stamp and delay of each message."""

import argparse
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from sensor_msgs.msg import CameraInfo, CompressedImage, Image

from fisheye_bridge.qos import IMAGE_INPUT
from fisheye_bridge.stamps import ns_of

KINDS = {kind.__name__: kind for kind in (Image, CompressedImage, CameraInfo)}


def main() -> None:
    """Subscribe until a signal comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('topic')
    parser.add_argument('--kind', choices=KINDS, default='Image')
    parser.add_argument('--pause', type=float, default=0.0, help='how long it takes each, s')
    arguments = parser.parse_args()

    def take(message):
        stamp_ns = ns_of(message.header.stamp)
        print(stamp_ns, f'{(time.time_ns() - stamp_ns) / 1e6:.1f}', flush=True)
        time.sleep(arguments.pause)

    try:
        rclpy.init()
        node = rclpy.create_node('subscriber')
        node.create_subscription(KINDS[arguments.kind], arguments.topic, take, IMAGE_INPUT)
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass


if __name__ == '__main__':
    main()
