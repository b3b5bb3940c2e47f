"""What stitch_node and panorama_node share: parameters, service, and the published panorama."""

from collections.abc import Iterator
from threading import Thread
from time import monotonic

from fisheye_msgs.msg import Overlaps, Projection
from fisheye_msgs.srv import CalibrateOverlap
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.node import Node

from fisheye_bridge.awaiting import awaitable
from fisheye_bridge.diagnostics import (
    ERROR,
    OK,
    WARN,
    WARNING_PAUSE_S,
    Diagnostics,
    OverloadMonitor,
    Report,
)
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import LATCHED
from fisheye_core.errors import FisheyeError, SettingError
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.nodes.imu_input import ImuInput
from panorama_stitch.nodes.overlap_message import overlap_messages
from panorama_stitch.nodes.panorama_publisher import (
    FRAME_ID,
    PanoramaPublisher,
    header_of,
)
from panorama_stitch.nodes.views import Views
from panorama_stitch.overlap.overlap_settings import METHODS
from panorama_stitch.pipeline.metrics import (
    economy_sentence,
    lag_sentence,
    metrics,
    unpaired_sentence,
)
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.panorama_settings import MountSettings, PanoramaOutputSettings
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline

_ANSWER_S = 10.0
"""Nobody waits longer for the answer of a service; what was asked for is done nevertheless."""


class PanoramaBase(Node):
    """A node that publishes panoramas; a subclass hands the frames to the pipeline."""

    def __init__(self, name: str, settings: type[PanoramaOutputSettings], **kwargs):
        super().__init__(name, **kwargs)
        declared = Parameters(self, settings, on_change=self._apply)
        mounts = [
            Parameters(self, MountSettings, prefix=f'{camera}.').settings
            for camera in declared.settings.cameras
        ]
        self.pipeline = StitchPipeline(declared.settings, mounts)
        self._announced: Compositor | None = None
        self._handled = 0
        self._overload = OverloadMonitor('pairs')
        self._panorama = PanoramaPublisher(self)
        self._projection = self.create_publisher(Projection, 'panorama/projection', LATCHED)
        self._overlaps = self.create_publisher(Overlaps, 'panorama/overlap', LATCHED)
        self._views = Views(self, FRAME_ID)
        # A group of its own: while an answer is awaited, rclpy runs nothing else of its group.
        self.create_service(
            CalibrateOverlap,
            'calibrate_overlap',
            self._calibrate,
            callback_group=MutuallyExclusiveCallbackGroup(),
        )
        self._imu = ImuInput(self, self.pipeline.feel)
        self._imu.follow(declared.settings.level == 'imu')
        self._diagnostics = Diagnostics(self, self._report)
        self._thread = Thread(target=self._publish_panoramas, name='compose', daemon=True)
        self._thread.start()

    @property
    def settings(self) -> PanoramaOutputSettings:
        """The current values of the parameters."""
        return self.pipeline.settings

    def inherit(self, former: 'PanoramaBase') -> None:
        """Go on with the overlaps of a node in whose place this one came."""
        self.pipeline.inherit(former.pipeline)

    def destroy_node(self) -> None:
        """End the threads too."""
        self.pipeline.stop()
        self._thread.join()
        self._panorama.stop()
        self._views.stop()
        super().destroy_node()

    def warn(self, sentence: str) -> None:
        """Log a warning, but not one after the other."""
        self.get_logger().warning(sentence, throttle_duration_sec=WARNING_PAUSE_S)

    def _apply(self, settings: PanoramaOutputSettings) -> None:
        self.pipeline.apply(settings)
        self._imu.follow(settings.level == 'imu')

    def _publish_panoramas(self) -> None:
        """Publish each panorama that the pipeline has, until it is stopped."""
        while (panorama := self.pipeline.next()) is not None:
            begin_s = monotonic()
            self._announce(panorama)
            self._handled += 1
            if not self._panorama.publish(panorama, self.settings) and self._views.wanted:
                panorama.expose()
            self._views.take(panorama)
            self.pipeline.leave_room(monotonic() - begin_s)

    def _announce(self, panorama: Panorama) -> None:
        """Publish what is in use from this panorama on, for those who come later too."""
        is_news = panorama.compositor is not self._announced
        header = header_of(panorama.stamp_ns)
        layout, rig = panorama.compositor.layout, self.pipeline.rig
        if is_news or panorama.orientation:
            level = {'orientation': panorama.orientation} if panorama.orientation else {}
            projection = projection_of(panorama.surface, header, wraps=layout.wraps, **level)
            self._projection.publish(projection)
        if is_news:
            self._announced = panorama.compositor
            overlaps = overlap_messages(self.pipeline.overlaps, rig, FRAME_ID, layout)
            self._overlaps.publish(Overlaps(header=header, overlaps=overlaps))

    async def _calibrate(self, request, response):
        try:
            if request.method not in ('', *METHODS):
                raise SettingError(
                    f"method is '{request.method}'; expected one of {', '.join(METHODS)}"
                )
            # Frames keep coming meanwhile: a coroutine, not a thread, waits for the answer.
            measured = await awaitable(
                self.pipeline.calibrate(request.method, request.save), within_s=_ANSWER_S
            )
            response.overlaps = overlap_messages(measured, self.pipeline.rig, FRAME_ID)
        except FisheyeError as error:
            response.success, response.message = False, str(error)
            return response
        sentences = [result.message for result in measured]
        if request.save:
            is_saved = all(result.found for result in measured)
            sentences.append('saved' if is_saved else 'not saved')
        response.success, response.message = True, '; '.join(sentences)
        return response

    def _report(self, report: Report) -> None:
        pipeline = self.pipeline
        for notice in pipeline.take_notices():
            self.warn(notice)
        if pipeline.compositor is None:
            report.add(ERROR, f'no panorama yet: {pipeline.trouble or "in preparation"}')
        elif pipeline.trouble:
            report.add(WARN, pipeline.trouble)
        for sentence in self._rig_faults():
            report.add(WARN, sentence)
        if sentence := economy_sentence(pipeline):
            report.add(OK, sentence)
        if pipeline.frames.unpaired_s:
            report.add(ERROR, unpaired_sentence(pipeline))
        elif sentence := lag_sentence(pipeline):
            report.add(WARN, sentence)
        ages_s = pipeline.frames.ages_s()
        all_stale = len(ages_s) == len(self.settings.cameras)
        for camera, age_s in ages_s.items():
            report.add(ERROR if all_stale else WARN, f'{camera}: no picture for {age_s:.0f} s')
        if not ages_s:
            # Frames without a partner are not shed: what they lack is another camera's.
            self._overload.tell(report, self._handled, pipeline.frames.overtaken)
        report.values.update(metrics(pipeline))
        self._panorama.report(report)
        self._views.report(report)

    def _rig_faults(self) -> Iterator[str]:
        """Return what is wrong with the rig, in sentences."""
        pipeline = self.pipeline
        if pipeline.compositor is not None:
            yield from pipeline.rig_faults
        yield from pipeline.watch.complaints()
        for camera, fault in pipeline.rig.faults.items():
            yield f'{camera}: {fault}'
        if self.settings.level == 'imu':
            yield from pipeline.level.faults()
