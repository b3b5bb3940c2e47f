"""Image topics: the raw picture and beside it the JPEG that image_transport would publish."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from fisheye_bridge.diagnostics import DropCounter
from fisheye_bridge.images import ImageBuffer, from_jpeg, jpeg_message, to_array, to_jpeg
from fisheye_bridge.qos import (
    ADJUSTABLE,
    BEST_EFFORT_INPUT,
    IMAGE,
    IMAGE_INPUT,
    VIDEO_INPUT,
)
from fisheye_bridge.video_input import VideoInput
from fisheye_core.errors import FisheyeError


class CameraPicture(Protocol):
    """An image of a camera, with its JPEG where the camera coded it."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""

    @property
    def image(self) -> np.ndarray:
        """(height, width[, 3]) uint8; possibly decoded only now."""

    @property
    def jpeg(self) -> np.ndarray | None:
        """(n,) uint8; None if the camera gave pixels."""


class ImagePublisher:
    """Publishes a picture raw and, on the `compressed` sub-topic, as JPEG; each only if wanted."""

    def __init__(self, node: Node, topic: str):
        self._node = node
        self._raw = node.create_publisher(Image, topic, IMAGE)
        self._jpeg = node.create_publisher(CompressedImage, f'{topic}/compressed', IMAGE)
        self._buffer: ImageBuffer | None = None

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return bool(self._raw.get_subscription_count() or self._jpeg.get_subscription_count())

    def destroy(self) -> None:
        """End the topics."""
        for publisher in (self._raw, self._jpeg):
            self._node.destroy_publisher(publisher)

    def publish(self, message: Image, image: np.ndarray, jpeg_quality: int) -> None:
        """Publish a message; `image` is the array (height, width[, 3]) of its pixels."""
        if self._raw.get_subscription_count():
            self._raw.publish(message)
        if self._jpeg.get_subscription_count():
            self._jpeg.publish(to_jpeg(image, message.encoding, message.header, jpeg_quality))

    def publish_picture(
        self, picture: CameraPicture, encoding: str, header: Header, jpeg_quality: int
    ) -> None:
        """Publish a camera's picture, its JPEG as it is where the camera gave one.

        Raises
        ------
        ImageFormatError
            If its pixels are wanted and broken.
        """
        if self._raw.get_subscription_count():
            width, height = picture.size
            if self._buffer is None or not self._buffer.fits(width, height, encoding):
                self._buffer = ImageBuffer(width, height, encoding)
            np.copyto(self._buffer.array, picture.image)
            self._buffer.message.header = header
            self._raw.publish(self._buffer.message)
        if self._jpeg.get_subscription_count():
            if picture.jpeg is None:
                message = to_jpeg(picture.image, encoding, header, jpeg_quality)
            else:
                message = jpeg_message(picture.jpeg, encoding, header)
            self._jpeg.publish(message)


@dataclass(frozen=True)
class _Transport:
    """How images travel: what carries them, on which sub-topic, and what makes arrays of it."""

    kind: type
    sub_topic: str
    qos: QoSProfile
    converter: Callable[[Node, str], Callable[..., tuple[np.ndarray, str] | None]]


_TRANSPORTS = {
    'raw': _Transport(Image, '', IMAGE_INPUT, lambda *_: to_array),
    'compressed': _Transport(CompressedImage, '/compressed', IMAGE_INPUT, lambda *_: from_jpeg),
    'video': _Transport(
        CompressedImage,
        '/video/compressed',
        VIDEO_INPUT,
        lambda node, topic: VideoInput(node, f'{topic}/video'),
    ),
}


class ImageSubscription:
    """Hands over the pictures of a topic as arrays, and keeps what is broken away.

    It is reliable until a publisher turns out not to be.

    Attributes
    ----------
    dropped : DropCounter
        Pictures that were not usable.
    """

    def __init__(
        self,
        node: Node,
        topic: str,
        callback: Callable[[np.ndarray, str, Header], None],
        *,
        transport: str = 'raw',
        key: str = 'pictures refused',
    ):
        """Subscribe.

        Parameters
        ----------
        node, topic
            Who subscribes to what.
        callback
            Called with (height, width[, 3]) uint8, its encoding and the header. A `FisheyeError`
            that it raises drops the picture with a warning.
        transport
            'raw', or 'compressed' or 'video' for that sub-topic.
        key
            Of the number of dropped pictures in the report.

        Raises
        ------
        VideoError
            If video is not possible here.
        """
        self._node = node
        self._callback = callback
        way = _TRANSPORTS[transport]
        self._kind, self._convert = way.kind, way.converter(node, topic)
        self._topic = topic + way.sub_topic
        self.dropped = DropCounter(node, f'a picture on {self._topic}', key)
        self._subscribe(
            way.qos,
            event_callbacks=SubscriptionEventCallbacks(incompatible_qos=self._make_do),
            qos_overriding_options=ADJUSTABLE,
        )

    def _subscribe(self, qos, **options) -> None:
        self._subscription = self._node.create_subscription(
            self._kind, self._topic, self._take, qos, **options
        )

    def _make_do(self, event) -> None:
        """Accept best-effort publishers: some images are better than none."""
        self._node.get_logger().warning(
            f'{self._topic} is published best effort: some pictures may be lost'
        )
        self._node.destroy_subscription(self._subscription)
        self._subscribe(BEST_EFFORT_INPUT)

    def _take(self, message) -> None:
        try:
            if converted := self._convert(message):
                self._callback(*converted, message.header)
        except FisheyeError as error:
            self.dropped.add(error)
