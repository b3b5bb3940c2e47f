"""Cameras to panorama in one process: each picture is warped straight into its place."""

from dataclasses import fields

from std_msgs.msg import Header

from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import ERROR, WARN, DropCounter, Report
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.running import run
from fisheye_bridge.stamps import ns_of, stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.calibration_url import calibration_of
from fisheye_capture.grabber import Grabber
from fisheye_capture.capture_settings import CameraSettings, CaptureSettings, FrameSettings
from fisheye_capture.source import shown_source
from fisheye_core.errors import CameraFileError, FisheyeError
from fisheye_geometry.image_circle import CircledLens
from fisheye_geometry.lens import Lens
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

TOPIC = 'topic'
"""The source that is no camera of this node: another one publishes the pictures."""


class PanoramaNode(PanoramaBase):
    """The cameras themselves to panorama/image."""

    SETTINGS = (('', PanoramaSettings), ('CAMERA.', CameraSettings))

    def __init__(self, **kwargs):
        super().__init__('panorama', PanoramaSettings, **kwargs)
        self._eyes = [_eye(self, camera) for camera in self.settings.cameras]
        for eye in self._eyes:
            eye.start()

    def destroy_node(self) -> None:
        """Release the cameras too."""
        for eye in getattr(self, '_eyes', ()):
            eye.stop()
        super().destroy_node()

    def _apply(self, settings: PanoramaSettings) -> None:
        eyes = getattr(self, '_eyes', ())
        for eye in eyes:
            eye.check(settings)  # all or none: nothing is refused half-way
        super()._apply(settings)
        for eye in eyes:
            eye.place(settings)

    def _report(self, report) -> None:
        super()._report(report)
        for eye in self._eyes:
            eye.report(report)


class _Eye:
    """One camera: where its frames come from, and what they show."""

    lens: Lens | None

    def __init__(self, node: PanoramaNode, name: str):
        self._node, self._name = node, name

    def check(self, settings: PanoramaSettings) -> None:
        """Raise a `GeometryError` if the camera's pictures cannot be shown like that."""
        if self.lens:
            settings.surface_of(self.lens)

    def place(self, settings: PanoramaSettings) -> None:
        """Say what the camera's pictures show, if it is known."""
        if self.lens:
            surface = settings.surface_of(self.lens)
            self._node.live.place(self._name, self.lens, surface, settings.interpolation)

    def start(self) -> None:
        """Begin to read."""

    def stop(self) -> None:
        """Release the camera."""


class _OwnEye(_Eye):
    """A camera that the node reads itself."""

    def __init__(self, node: PanoramaNode, name: str, own: CameraSettings):
        super().__init__(node, name)
        shared = {
            entry.name: getattr(node.settings, entry.name) for entry in fields(FrameSettings)
        }
        named = {
            entry.name: getattr(own.named(name), entry.name) for entry in fields(CameraSettings)
        }
        self._settings = CaptureSettings(**named, **shared)
        self._raw = ImagePublisher(node, f'{name}/image_raw')
        self._grabber = Grabber(self._settings, self._take, on_change=self._tell)
        url, called = self._settings.camera_info_url, self._settings.camera_name
        camera = calibration_of(url, called) or self._grabber.camera
        if camera is None:
            shown = shown_source(own.source)
            raise CameraFileError(
                f'{name}.camera_info_url is empty; expected the calibration file of {shown} '
                '(calibrate_lens makes one)'
            )
        self._camera, self._seen, self._fault = camera, CircledLens(camera.lens), ''
        self._broken = DropCounter(node, f'a picture of {name}', f'{name} broken')
        self.place(node.settings)
        if self._grabber.attempts:
            self._tell(self._grabber.reason)

    @property
    def lens(self) -> Lens:
        return self._seen.lens

    def start(self) -> None:
        self._grabber.start()

    def stop(self) -> None:
        self._grabber.stop()

    def report(self, report: Report) -> None:
        grabber = self._grabber
        report.values[f'{self._name} skipped'] = grabber.skipped
        report.values[f'{self._name} damaged'] = grabber.damaged
        for level, sentence in (
            (ERROR, grabber.complaint),
            (WARN, grabber.note),
            (WARN, grabber.damage()),
            (ERROR, self._fault),
            (WARN, self._seen.note),
        ):
            if sentence:
                report.add(level, f'{self._name}: {sentence}')
        self._broken.tell(report)

    def _take(self, frame) -> None:
        fault, self._fault = self._fault, self._camera.size_mismatch(*frame.size)
        if self._fault:
            if not fault:
                self._node.warn(f'{self._name}: {self._fault}')
            return
        try:
            image, encoding = frame.image, self._settings.encoding
        except FisheyeError as error:
            self._broken.add(error)
            return
        noted = self._seen.note
        if self._seen.look(image):
            self.place(self._node.settings)
        if self._seen.note and not noted:
            self._node.warn(f'{self._name}: {self._seen.note}')
        self._node.take(self._name, frame.stamp_ns, image, encoding)
        if self._raw.wanted:
            header = Header(stamp=stamp_of(frame.stamp_ns), frame_id=self._settings.frame_id)
            quality = self._node.settings.jpeg_quality
            self._raw.publish_picture(frame, encoding, header, quality)

    def _tell(self, reason: str) -> None:
        news = f'{self._name}: {self._grabber.news(reason)}'
        if reason:
            self._node.warn(news)
        else:
            self._node.get_logger().info(news)


class _TopicEye(_Eye):
    """A camera that another node reads."""

    def __init__(self, node: PanoramaNode, name: str):
        super().__init__(node, name)
        self._camera = CameraSubscription(
            node,
            on_picture=self._take,
            on_lens=lambda lens, header: self.place(node.settings),
            check=lambda lens: node.settings.surface_of(lens),
            namespace=name,
            transport=node.settings.transport,
        )

    @property
    def lens(self) -> Lens | None:
        return self._camera.lens

    def report(self, report: Report) -> None:
        self._camera.report(report, is_used=self._node.live.stitcher.has_camera(self._name))

    def _take(self, image, encoding, header) -> None:
        self._node.take(self._name, ns_of(header.stamp), image, encoding)


def _eye(node: PanoramaNode, name: str) -> _OwnEye | _TopicEye:
    own = Parameters(node, CameraSettings, prefix=f'{name}.').settings
    return _TopicEye(node, name) if own.source == TOPIC else _OwnEye(node, name, own)


def main() -> int:
    """Run the node."""
    return run(PanoramaNode)
