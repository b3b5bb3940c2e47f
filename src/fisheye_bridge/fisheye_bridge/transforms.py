"""Where frames are, for tf2; nothing is published where tf2_msgs is not installed."""

from collections.abc import Sequence

from geometry_msgs.msg import Quaternion, TransformStamped
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import Header

from fisheye_bridge.qos import LATCHED
from fisheye_geometry.attitude import Attitude, quaternion

try:
    from tf2_msgs.msg import TFMessage
except ImportError:  # it is no part of ROS's wheels
    TFMessage = None


def transform(header: Header, frame_id: str, attitude: Attitude) -> TransformStamped:
    """Return where a frame is that is turned in the frame of a header, at the same place."""
    x, y, z, w = quaternion(attitude)
    message = TransformStamped(header=header, child_frame_id=frame_id)
    message.transform.rotation = Quaternion(x=x, y=y, z=z, w=w)
    return message


class TransformPublisher:
    """Publishes frames that stay where they are, and others that move."""

    def __init__(self, node: Node):
        """Prepare; publishers are made when they are needed."""
        self._node = node
        self._static: Publisher | None = None
        self._moving: Publisher | None = None

    def stay(self, transforms: Sequence[TransformStamped]) -> None:
        """Publish all frames that stay where they are, for those who come later too."""
        if TFMessage and (transforms or self._static):
            if self._static is None:
                self._static = self._node.create_publisher(TFMessage, '/tf_static', LATCHED)
            self._static.publish(TFMessage(transforms=transforms))

    def move(self, transforms: Sequence[TransformStamped]) -> None:
        """Publish frames that move, at the time of their headers."""
        if TFMessage:
            if self._moving is None:
                self._moving = self._node.create_publisher(TFMessage, '/tf', 100)
            self._moving.publish(TFMessage(transforms=transforms))
