"""Pictures as video, encoded while anybody subscribes, in every message type that is installed."""

from array import array
from collections import deque
from time import monotonic
from typing import TYPE_CHECKING

import numpy as np
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.node import Node
from std_msgs.msg import Empty, Header

from fisheye_bridge.diagnostics import WARN, Report
from fisheye_bridge.qos import VIDEO
from fisheye_bridge.video_messages import VideoPicture, message_types
from fisheye_core.errors import FisheyeError
from fisheye_core.latest_only import LatestOnlyWorker
from fisheye_core.rate_meter import RateMeter
from fisheye_core.video import video_encoder
from fisheye_core.video_settings import VideoSettings

if TYPE_CHECKING:
    from fisheye_core.h264_encoder import EncodedPicture, H264Encoder

_ANSWER_S = 0.3
"""Who asks for a keyframe sooner after one has not seen it yet."""
_WELCOME_S = 0.0, 0.15
"""When keyframes come after a subscriber: it may hear the publisher only after the first."""
_REPORT_S = 1.0


class VideoPublisher:
    """Publishes pictures as video while anybody subscribes, encoded in a thread of its own."""

    def __init__(self, node: Node, image: str, video: str):
        """Advertise the topics that belong to the pictures on the topic `image`."""
        self._node, self._video = node, video
        self._encoder: H264Encoder | None = None
        self._fault, self._keyframe_s = '', 0.0
        self._due_s: deque[float] = deque()
        self._rate, self._encoding_ms, self._bytes = RateMeter(), 0.0, 0
        self._reported = 0, monotonic()
        joined = PublisherEventCallbacks(matched=self._welcome)
        self._publishers = [
            (
                kind,
                kind_class,
                node.create_publisher(
                    kind_class,
                    kind.topic.format(image=image, video=video),
                    VIDEO,
                    event_callbacks=joined,
                ),
            )
            for kind, kind_class in message_types()
        ]
        node.create_subscription(Empty, f'{video}/keyframe', self._take_request, VIDEO)
        self._worker = LatestOnlyWorker(self._publish, 'video', on_error=self._failed)

    @property
    def wanted(self) -> bool:
        """Whether anybody subscribes."""
        return any(publisher.get_subscription_count() for *_, publisher in self._publishers)

    def put(
        self, image: np.ndarray, encoding: str, header: Header, settings: VideoSettings
    ) -> None:
        """Queue a copy of a picture to be encoded, in place of one that still waits.

        Parameters
        ----------
        image
            (height, width[, 3]) uint8.
        encoding
            One of `fisheye_core.encodings.CHANNELS`.
        header, settings
            Of the messages; those of now.
        """
        self._worker.put(VideoPicture(image.copy(), encoding, header, settings))

    def stop(self) -> None:
        """End the thread."""
        self._worker.stop()

    def report(self, report: Report) -> None:
        """Report what is wrong with the encoder, and while anybody subscribes its numbers."""
        if not self.wanted:
            return
        if self._fault:
            report.add(WARN, f'{self._video}: {self._fault}')
        (former, former_s), now_s = self._reported, monotonic()
        self._reported = self._bytes, now_s
        kbits = 8e-3 * (self._bytes - former)
        report.values['video encoder'] = self._encoder.name if self._encoder else 'none'
        report.values['video rate Hz'] = self._rate.hz
        report.values['video kbit/s'] = kbits / max(now_s - former_s, _REPORT_S / 2)
        report.values['video encoding ms'] = self._encoding_ms
        report.values['video pictures skipped'] = self._worker.dropped

    def _welcome(self, change) -> None:
        if change.total_count_change > 0:
            self._due_s.extend(monotonic() + after_s for after_s in _WELCOME_S)

    def _take_request(self, _: Empty) -> None:
        if monotonic() - self._keyframe_s > _ANSWER_S:
            self._due_s.append(monotonic())

    def _publish(self, picture: VideoPicture) -> None:
        begin_s = monotonic()
        encoded = self._encoded(picture)
        self._encoding_ms = 1e3 * (monotonic() - begin_s)
        self._rate.count()
        self._bytes += len(encoded.data)
        data = array('B')
        data.frombytes(encoded.data)
        for kind, kind_class, publisher in self._publishers:
            if publisher.get_subscription_count():
                publisher.publish(kind_class(data=data, **kind.fields(encoded, picture)))

    def _encoded(self, picture: VideoPicture) -> 'EncodedPicture':
        settings = picture.settings
        encoder = self._encoder = self._encoder or video_encoder(settings)
        encoder.bitrate_kbps = settings.video_bitrate_kbps
        encoder.keyframe_s = settings.video_keyframe_s
        if self._is_keyframe_due():
            encoder.request_keyframe()
        encoded = encoder.encode(picture.image, picture.encoding)
        if encoded.is_keyframe:
            self._keyframe_s = monotonic()
        self._tell(encoder.note)
        return encoded

    def _is_keyframe_due(self) -> bool:
        now_s, is_due = monotonic(), False
        while self._due_s and self._due_s[0] <= now_s:
            self._due_s.popleft()
            is_due = True
        return is_due

    def _failed(self, error: FisheyeError) -> None:
        self._encoder = None
        self._tell(str(error))

    def _tell(self, fault: str) -> None:
        if fault and fault != self._fault:
            self._node.get_logger().warning(f'{self._video}: {fault}')
        self._fault = fault
