"""Video as it is taken: pictures without delay, none that is drawn upon a gap."""

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage
from std_msgs.msg import Empty

from fisheye_bridge.qos import VIDEO
from fisheye_bridge.stamps import ns_of
from fisheye_core.errors import ImageFormatError
from fisheye_core.video import video_decoder


class VideoInput:
    """Decodes the messages of a video topic; where it needs a keyframe, it asks for one."""

    def __init__(self, node: Node, video: str):
        """Start; `video` is the topic without `/compressed`.

        Raises
        ------
        VideoError
            If PyAV is missing.
        """
        self._decoder = video_decoder()
        self._requests = node.create_publisher(Empty, f'{video}/keyframe', VIDEO)

    def __call__(self, message: CompressedImage) -> tuple[np.ndarray, str] | None:
        """Return the picture of a message as BGR, and that; None before the first keyframe.

        Raises
        ------
        ImageFormatError
            If it is broken, or drawn upon one that is.
        """
        damaged = self._decoder.damaged
        # Pictures that waited for their turn are none that are missing.
        taken_s = ns_of(message.header.stamp) * 1e-9
        image = self._decoder.decode(bytes(message.data), now_s=taken_s)
        if self._decoder.wants_keyframe:
            self._requests.publish(Empty())
        if self._decoder.damaged > damaged and image is None:
            raise ImageFormatError(
                f'{len(message.data)} bytes of video are broken, or pictures before them are '
                'missing; expected is a keyframe now, which is asked for'
            )
        return None if image is None else (image, 'bgr8')
