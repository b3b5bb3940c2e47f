"""Where the panorama node's frames come from: its own cameras, and those that other nodes read."""

from dataclasses import fields

from std_msgs.msg import Header

from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import ERROR, WARN, DropCounter, Report
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.stamps import ns_of, stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.calibration_url import calibration_of
from fisheye_capture.capture_settings import CameraSettings, CaptureSettings, FrameSettings
from fisheye_capture.grabber import Grabber
from fisheye_capture.source import shown_source
from fisheye_core.errors import CameraFileError, FisheyeError
from fisheye_geometry.image_circle import CircledLens
from fisheye_geometry.lens import Lens
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

TOPIC = 'topic'
"""The source that is no camera of this node: another one publishes the images."""


class CameraInput:
    """One camera of the panorama node: where its frames come from, and what they show."""

    lens: Lens | None

    def __init__(self, node: PanoramaBase, name: str):
        self._node, self._name = node, name

    def check(self, settings: PanoramaSettings) -> None:
        """Raise a `GeometryError` if the camera's pictures cannot be shown like that."""
        if self.lens:
            settings.surface_of(self.lens)

    def place(self, settings: PanoramaSettings) -> None:
        """Tell the pipeline what the camera's images show, if it is known."""
        if self.lens:
            surface = settings.surface_of(self.lens)
            self._node.pipeline.place(self._name, self.lens, surface, settings.interpolation)

    def start(self) -> None:
        """Begin to read."""

    def stop(self) -> None:
        """Release the camera."""


class LocalCamera(CameraInput):
    """A camera that the node reads itself."""

    def __init__(self, node: PanoramaBase, name: str, own: CameraSettings):
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
        """What the camera sees, within the circle that the lens lights."""
        return self._seen.lens

    def start(self) -> None:
        """Begin to read."""
        self._grabber.start()

    def stop(self) -> None:
        """Release the camera."""
        self._grabber.stop()

    def report(self, report: Report) -> None:
        """Report what is wrong with the camera, and its numbers."""
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
        self._node.pipeline.take(self._name, frame.stamp_ns, image, encoding)
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


class RemoteCamera(CameraInput):
    """A camera that another node reads."""

    def __init__(self, node: PanoramaBase, name: str):
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
        """What the camera sees; None before a camera_info came."""
        return self._camera.lens

    def report(self, report: Report) -> None:
        """Report what is wrong with the camera, and its numbers."""
        self._camera.report(report, is_used=self._node.pipeline.rig.has_camera(self._name))

    def _take(self, image, encoding, header) -> None:
        self._node.pipeline.take(self._name, ns_of(header.stamp), image, encoding)


def camera_input(node: PanoramaBase, name: str) -> LocalCamera | RemoteCamera:
    """Return the input of a camera, as its parameters say."""
    own = Parameters(node, CameraSettings, prefix=f'{name}.').settings
    return RemoteCamera(node, name) if own.source == TOPIC else LocalCamera(node, name, own)
