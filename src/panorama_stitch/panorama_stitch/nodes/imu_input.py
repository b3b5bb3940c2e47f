"""An IMU, while its level is wanted: its messages come by the hundred a second."""

from collections.abc import Callable

from rclpy.node import Node
from rclpy.subscription import Subscription
from sensor_msgs.msg import Imu

from fisheye_bridge.imu import reading_of
from fisheye_bridge.qos import SENSOR_INPUT
from fisheye_geometry.inertial import ImuReading


class ImuInput:
    """Hands over the readings on the topic `imu`."""

    def __init__(self, node: Node, take: Callable[[ImuReading], None]):
        """Start deaf; `take` gets each reading that says where down is."""
        self._node, self._handle = node, take
        self._subscription: Subscription | None = None

    def follow(self, is_wanted: bool) -> None:
        """Subscribe where it is wanted, and only then."""
        if is_wanted and self._subscription is None:
            self._subscription = self._node.create_subscription(
                Imu, 'imu', self._take, SENSOR_INPUT
            )
        elif not is_wanted and self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _take(self, message: Imu) -> None:
        if reading := reading_of(message):
            self._handle(reading)
