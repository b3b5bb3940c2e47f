"""What stitch_node and panorama_node share: parameters, service, and the published panorama."""

from collections import deque
from collections.abc import Sequence
from dataclasses import asdict
from itertools import pairwise
from math import degrees

import numpy as np
from fisheye_msgs.msg import Overlap, Overlaps, Particle, Projection
from fisheye_msgs.srv import CalibrateOverlap
from rclpy.node import Node
from std_msgs.msg import Header

from fisheye_bridge.awaiting import awaitable
from fisheye_bridge.diagnostics import ERROR, WARN, WARNING_PAUSE_S, Diagnostics, Report, OverloadMonitor
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import LATCHED
from fisheye_bridge.stamps import stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_core.rate_meter import RateMeter
from fisheye_core.encodings import converted
from fisheye_core.errors import FisheyeError, SettingError
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline.stale import write_age
from panorama_stitch.pipeline.metrics import metrics, latencies, unpaired
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline
from panorama_stitch.overlap.overlap_result import Overlap as OverlapResult
from panorama_stitch.overlap.overlap_result import yaw_between_rad
from panorama_stitch.overlap.overlap_settings import METHODS
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

FRAME_ID = 'panorama_optical_frame'
_LATENCIES = 300


class PanoramaBase(Node):
    """A node that publishes panoramas; where the frames come from is the business of others."""

    def __init__(self, name: str, settings: type[PanoramaOutputSettings], **kwargs):
        super().__init__(name, **kwargs)
        self._declared = Parameters(self, settings, on_change=self._apply)
        self._buffer: ImageBuffer | None = None
        self._color = ''
        self._handled, self._published, self._rate = 0, 0, RateMeter()
        self._shedding = OverloadMonitor('pairs')
        self._latencies_ms: deque[float] = deque(maxlen=_LATENCIES)
        self._image = ImagePublisher(self, 'panorama/image')
        self._projection = self.create_publisher(Projection, 'panorama/projection', LATCHED)
        self._overlaps = self.create_publisher(Overlaps, 'panorama/overlap', LATCHED)
        self.live = StitchPipeline(
            self.settings, publish=self._publish, changed=self._announce, warn=self.warn
        )
        self.create_service(CalibrateOverlap, 'calibrate_overlap', self._calibrate)
        self._diagnostics = Diagnostics(self, self._report)

    @property
    def settings(self) -> PanoramaOutputSettings:
        """The current values of the parameters."""
        return self._declared.settings

    def take(self, camera: str, stamp_ns: int, image: np.ndarray, encoding: str) -> None:
        """Take a frame of a camera; the first one in colour decides the order of the channels."""
        if encoding != 'mono8':
            self._color = self._color or encoding
            image = converted(image, encoding, self._color)
        self.live.take(camera, stamp_ns, image)

    def destroy_node(self) -> None:
        """End the threads too."""
        self.live.stop()
        super().destroy_node()

    def _apply(self, settings: PanoramaOutputSettings) -> None:
        self.live.apply(settings)

    def _publish(
        self,
        compositor: Compositor,
        images: Sequence[np.ndarray],
        stamp_ns: int,
        ages_s: dict[str, float],
    ) -> None:
        self._handled += 1
        if not self._image.wanted:
            return
        surface = compositor.layout.surface
        encoding = 'mono8' if images[0].ndim == 2 else self._color
        size = surface.width, surface.height, encoding
        if self._buffer is None or not self._buffer.fits(*size):
            self._buffer = ImageBuffer(*size)
        compositor.compose(images, self._buffer.array, are_live=not ages_s)
        for camera, age_s in ages_s.items():
            columns = compositor.layout.shown_columns(self.settings.cameras.index(camera))
            write_age(self._buffer.array, columns, camera, age_s)
        self._buffer.message.header = _header(stamp_ns)
        self._image.publish(self._buffer.message, self._buffer.array, self.settings.jpeg_quality)
        self._published += 1
        self._rate.count()
        self._latencies_ms.append((self.get_clock().now().nanoseconds - stamp_ns) / 1e6)

    def _announce(self, stamp_ns: int) -> None:
        """Publish what is in use from some pictures on, for those who come later too."""
        header = _header(stamp_ns)
        surface = self.live.compositor.layout.surface
        self._projection.publish(projection_of(surface, header))
        effective_overlaps = self.live.stitcher.effective_overlaps(self.settings)
        self._overlaps.publish(Overlaps(header=header, overlaps=self._messages(effective_overlaps)))

    async def _calibrate(self, request, response):
        try:
            if request.method not in ('', *METHODS):
                raise SettingError(
                    f"method is '{request.method}'; expected one of {', '.join(METHODS)}"
                )
            # Frames keep coming meanwhile: a coroutine, not a thread, waits for the answer.
            measured = await awaitable(self.live.calibrate(request.method, request.save))
            response.overlaps = self._messages(measured)
        except FisheyeError as error:
            response.success, response.message = False, str(error)
            return response
        sentences = [result.message for result in measured]
        if request.save:
            is_saved = all(result.found for result in measured)
            sentences.append('saved' if is_saved else 'not saved')
        response.success, response.message = True, '; '.join(sentences)
        return response

    def _messages(self, results: Sequence[OverlapResult]) -> list[Overlap]:
        cameras, surfaces = self.settings.cameras, self.live.stitcher.surfaces
        neighbours = pairwise(cameras), pairwise(surfaces)
        return [_overlap_message(*entry) for entry in zip(results, *neighbours, strict=True)]

    def warn(self, sentence: str) -> None:
        """Log a warning, but not one after the other."""
        self.get_logger().warning(sentence, throttle_duration_sec=WARNING_PAUSE_S)

    def _report(self, report: Report) -> None:
        live = self.live
        if live.compositor is None:
            report.add(ERROR, f'no panorama yet: {live.trouble or "in preparation"}')
        elif live.trouble:
            report.add(WARN, live.trouble)
        if not all(result.found for result in live.overlaps):
            report.add(WARN, 'no overlap: frames are side by side')
        if live.unpaired_s > self.settings.stale_after_s:
            report.add(ERROR, unpaired(live, self.settings))
        ages_s = live.ages_s()
        all_stale = len(ages_s) == len(self.settings.cameras)
        for camera, age_s in ages_s.items():
            report.add(ERROR if all_stale else WARN, f'{camera}: no picture for {age_s:.0f} s')
        if not ages_s:
            # Frames without a partner are not shed: what they lack is another camera's.
            self._shedding.tell(report, self._handled, live.dropped)
        report.values['rate Hz'] = self._rate.hz
        report.values['panoramas published'] = self._published
        report.values.update(metrics(live))
        report.values.update(latencies(self._latencies_ms))


def _header(stamp_ns: int) -> Header:
    return Header(stamp=stamp_of(stamp_ns), frame_id=FRAME_ID)


def _overlap_message(result: OverlapResult, names, surfaces) -> Overlap:
    """Describe the overlap of two neighbours."""
    return Overlap(
        header=_header(result.stamp_ns),
        left_camera=names[0],
        right_camera=names[1],
        method=result.method,
        found=result.found,
        offset_x_px=result.offset_x_px,
        offset_y_px=result.offset_y_px,
        offset_deg=degrees(yaw_between_rad(result.offset_x_px, *surfaces)),
        pitch_deg=degrees(result.turn.pitch_rad),
        roll_deg=degrees(result.turn.roll_rad),
        overlap_px=result.overlap_px,
        confidence=result.confidence,
        min_correlation_value=result.min_correlation_value,
        left_particles=[Particle(**asdict(particle)) for particle in result.left_particles],
        right_particles=[Particle(**asdict(particle)) for particle in result.right_particles],
        left_match=result.left_match,
        right_match=result.right_match,
    )
