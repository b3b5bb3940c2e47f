"""Prints transforms as JSON, a line a message: TOPIC COUNT, in the environment of tf2_msgs."""

import json
import sys

import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile
from tf2_msgs.msg import TFMessage

from fisheye_bridge.stamps import ns_of


def main(topic: str, count: int) -> None:
    """Listen until so many messages came."""
    rclpy.init()
    node = rclpy.create_node('tf_listener')
    came = []
    durability = (
        DurabilityPolicy.TRANSIENT_LOCAL if 'static' in topic else DurabilityPolicy.VOLATILE
    )
    node.create_subscription(
        TFMessage, topic, came.append, QoSProfile(depth=100, durability=durability)
    )
    while len(came) < count:
        rclpy.spin_once(node, timeout_sec=0.1)
    for message in came[:count]:
        print(json.dumps([described(each) for each in message.transforms]))
    rclpy.shutdown()


def described(transform) -> dict:
    """Return frames, stamp and rotation."""
    q = transform.transform.rotation
    return {
        'parent': transform.header.frame_id,
        'child': transform.child_frame_id,
        'stamp_ns': ns_of(transform.header.stamp),
        'rotation': [q.x, q.y, q.z, q.w],
    }


if __name__ == '__main__':
    main(sys.argv[1], int(sys.argv[2]))
