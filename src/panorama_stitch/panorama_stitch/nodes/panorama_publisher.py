"""The panorama as a topic: drawn only if somebody subscribes, raw, as JPEG and as video."""

from collections import deque

from rclpy.node import Node
from std_msgs.msg import Header

from fisheye_bridge.diagnostics import Report
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.stamps import stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_bridge.video_publisher import VideoPublisher
from fisheye_core.rate_meter import RateMeter
from panorama_stitch.pipeline.metrics import latency_metrics
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

FRAME_ID = 'panorama_optical_frame'
_LATENCIES = 300


class PanoramaPublisher:
    """Draws panoramas straight into the message that is published."""

    def __init__(self, node: Node):
        self._clock = node.get_clock()
        self._image = ImagePublisher(node, 'panorama/image')
        self._video = VideoPublisher(node, 'panorama/image', 'panorama/video')
        self._buffer: ImageBuffer | None = None
        self._published, self._rate = 0, RateMeter()
        self._latencies_ms: deque[float] = deque(maxlen=_LATENCIES)

    def publish(self, panorama: Panorama, settings: PanoramaOutputSettings) -> bool:
        """Draw a panorama and publish it if anybody subscribes; return whether it was drawn."""
        is_video_wanted = self._video.wanted
        if not (self._image.wanted or is_video_wanted):
            return False
        surface = panorama.surface
        size = surface.width, surface.height, panorama.encoding
        if self._buffer is None or not self._buffer.fits(*size):
            self._buffer = ImageBuffer(*size)
        message, image = self._buffer.message, self._buffer.array
        panorama.draw(image)
        message.header = header_of(panorama.stamp_ns)
        self._image.publish(message, image, settings.jpeg_quality)
        if is_video_wanted:
            self._video.put(image, panorama.encoding, message.header, settings)
        self._published += 1
        self._rate.count()
        age_ns = self._clock.now().nanoseconds - panorama.stamp_ns
        self._latencies_ms.append(age_ns / 1e6)
        return True

    def stop(self) -> None:
        """End the thread of the encoder."""
        self._video.stop()

    def report(self, report: Report) -> None:
        """Report the numbers, and what is wrong with the encoder."""
        report.values['rate Hz'] = self._rate.hz
        report.values['panoramas published'] = self._published
        report.values.update(latency_metrics(self._latencies_ms))
        self._video.report(report)


def header_of(stamp_ns: int) -> Header:
    """Return the header of what belongs to a panorama."""
    return Header(stamp=stamp_of(stamp_ns), frame_id=FRAME_ID)
