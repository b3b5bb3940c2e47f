"""Takes one keyframe and one other picture of each foreign message of the panorama; writes JSON.

Run by `test_video.py` in an environment that has the message packages, which pytest's has not.
"""

import json
import sys
from pathlib import Path

import rclpy
from ffmpeg_image_transport_msgs.msg import FFMPEGPacket
from foxglove_msgs.msg import CompressedVideo
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.qos import VIDEO_INPUT
from fisheye_bridge.stamps import ns_of
from fisheye_core.nal_units import is_keyframe

TOPICS = (
    (CompressedImage, 'panorama/video/compressed', ('format',)),
    (CompressedVideo, 'panorama/video', ('format', 'frame_id')),
    (FFMPEGPacket, 'panorama/image/ffmpeg', ('encoding', 'width', 'height', 'flags', 'pts')),
)


def main():
    """Write what came on each topic, by its stamp."""
    taken = {topic: {} for _, topic, _ in TOPICS}

    def take(topic, fields, message):
        header = getattr(message, 'header', None)
        data = bytes(message.data)
        taken[topic][ns_of(header.stamp if header else message.timestamp)] = {
            'data': data.hex(),
            'is_keyframe': is_keyframe(data),
            **{field: getattr(message, field) for field in fields},
        }

    rclpy.init()
    node = rclpy.create_node('video_client')
    subscriptions = [
        node.create_subscription(
            kind, topic, lambda m, topic=topic, fields=fields: take(topic, fields, m), VIDEO_INPUT
        )
        for kind, topic, fields in TOPICS
    ]
    while len(set.intersection(*map(set, taken.values()))) < 40 and subscriptions:
        rclpy.spin_once(node)
    Path(sys.argv[1]).write_text(json.dumps(taken))


if __name__ == '__main__':
    main()
