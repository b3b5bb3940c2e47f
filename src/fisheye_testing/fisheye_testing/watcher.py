"""A subscriber like a teleoperation stack: takes panoramas and knows what came and when."""

import threading
import time
from contextlib import suppress

import numpy as np
import rclpy
from fisheye_msgs.msg import Overlaps, Projection
from fisheye_msgs.srv import CalibrateOverlap
from rclpy._rclpy_pybind11 import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Image

from fisheye_testing.image_message import stamp_ns, to_array

IMAGE_INPUT = QoSProfile(depth=3, reliability=ReliabilityPolicy.RELIABLE)
LATCHED = QoSProfile(
    depth=1, reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL
)


class Watcher:
    """Subscribes to a rig's panorama from a ROS context of its own.

    Attributes
    ----------
    stamps_ns, latencies_ms : list
        Of every panorama that came.
    newest : Image or None
        The last one.
    projection, overlaps
        The last messages of these topics, None before the first.
    """

    def __init__(self, domain: int, namespace: str = ''):
        self.stamps_ns: list[int] = []
        self.latencies_ms: list[float] = []
        self.newest = self.projection = None
        self.overlaps: Overlaps | None = None
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self.node = rclpy.create_node('watcher', context=self._context, namespace=namespace)
        for kind, topic, take, qos in (
            (Image, 'panorama/image', self._take, IMAGE_INPUT),
            (Projection, 'panorama/projection', self._take_projection, LATCHED),
            (Overlaps, 'panorama/overlap', self._take_overlaps, LATCHED),
        ):
            self.node.create_subscription(kind, topic, take, qos)
        self._client = self.node.create_client(CalibrateOverlap, 'calibrate_overlap')
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)
        self._is_done = False
        self._thread = threading.Thread(target=self._spin, daemon=True)
        self._thread.start()

    def __enter__(self) -> 'Watcher':
        return self

    def __exit__(self, *_) -> None:
        self._is_done = True
        self._thread.join()
        self._executor.shutdown()
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)

    @property
    def is_measured(self) -> bool:
        """Whether every overlap was looked for, and the projection drawn with them came.

        A lone camera is shown for a while too, and each topic arrives on its own.
        """
        return (
            self.overlaps is not None
            and self.projection is not None
            and all(each.method for each in self.overlaps.overlaps)
            and stamp_ns(self.projection.header) >= stamp_ns(self.overlaps.header)
        )

    def restart(self) -> None:
        """Forget what came so far."""
        self.stamps_ns, self.latencies_ms = [], []

    def picture(self) -> np.ndarray:
        """Return a copy of the newest panorama."""
        return to_array(self.newest).copy()

    def picture_on(self, topic: str, timeout_s: float = 10.0) -> np.ndarray:
        """Return the next picture of an image topic."""
        taken, came = [], threading.Event()

        def take(message):
            taken.append(message)
            came.set()

        subscription = self.node.create_subscription(Image, topic, take, IMAGE_INPUT)
        if not came.wait(timeout_s):
            raise TimeoutError(f'no picture came on {topic} within {timeout_s:g} s')
        self.node.destroy_subscription(subscription)
        return to_array(taken[0])

    def calibrate(self, timeout_s: float = 20.0, **request) -> CalibrateOverlap.Response:
        """Call the rig's calibrate_overlap service."""
        if not self._client.wait_for_service(timeout_s):
            raise TimeoutError(f'calibrate_overlap was not offered within {timeout_s:g} s')
        done = threading.Event()
        future = self._client.call_async(CalibrateOverlap.Request(**request))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(timeout_s):
            raise TimeoutError(f'calibrate_overlap gave no answer within {timeout_s:g} s')
        return future.result()

    def _spin(self) -> None:
        while not self._is_done:
            # A test may end a subscription just when the executor is about to look at it.
            with suppress(InvalidHandle):
                self._executor.spin_once(timeout_sec=0.1)

    def _take(self, message) -> None:
        taken_ns = stamp_ns(message.header)
        self.stamps_ns.append(taken_ns)
        self.latencies_ms.append((time.time_ns() - taken_ns) / 1e6)
        self.newest = message

    def _take_projection(self, message) -> None:
        self.projection = message

    def _take_overlaps(self, message) -> None:
        self.overlaps = message
