"""A client of the video: decodes panorama/video/compressed, and writes its first picture.

python examples/take_video.py PICTURE
"""

import sys
from contextlib import suppress

import av
import cv2
import rclpy
from sensor_msgs.msg import CompressedImage

decoder = av.CodecContext.create('h264', 'r')
decoder.thread_count = 1  # several would hold pictures back
pictures = []


def take(message):
    """Decode a message, which is one picture; before the first keyframe there is nothing."""
    with suppress(av.error.InvalidDataError):
        frames = decoder.decode(av.Packet(message.data.tobytes()))
        pictures.extend(frame.to_ndarray(format='bgr24') for frame in frames)


rclpy.init()
node = rclpy.create_node('take_video')
node.create_subscription(CompressedImage, 'panorama/video/compressed', take, 30)
while not pictures:
    rclpy.spin_once(node)
cv2.imwrite(sys.argv[1], pictures[-1])
