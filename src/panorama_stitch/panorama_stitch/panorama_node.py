"""Cameras to panorama in one process: each picture is warped straight into its place."""

from dataclasses import fields

from std_msgs.msg import Header

from fisheye_bridge.diagnostics import ERROR
from fisheye_bridge.images import to_message
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.running import run
from fisheye_bridge.stamps import stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.calibration_url import calibration_of
from fisheye_capture.grabber import Grabber
from fisheye_capture.settings import CameraSettings, CaptureSettings, FrameSettings
from fisheye_geometry.errors import CameraFileError
from fisheye_geometry.image_circle import ImageCircle
from panorama_stitch.base_node import PanoramaBase
from panorama_stitch.settings import PanoramaSettings


class PanoramaNode(PanoramaBase):
    """The cameras themselves to panorama/image."""

    def __init__(self, **kwargs):
        super().__init__('panorama', PanoramaSettings, **kwargs)
        self._eyes = [_Eye(self, camera) for camera in self.settings.cameras]
        for eye in self._eyes:
            eye.grabber.start()

    def destroy_node(self) -> None:
        """Release the cameras too."""
        for eye in getattr(self, '_eyes', ()):
            eye.grabber.stop()
        super().destroy_node()

    def _apply(self, settings: PanoramaSettings) -> None:
        for eye in getattr(self, '_eyes', ()):
            eye.place(settings)
        super()._apply(settings)

    def _report(self, report) -> None:
        super()._report(report)
        for eye in self._eyes:
            grabber = eye.grabber
            report.values[f'{eye.name} skipped'] = grabber.skipped
            if grabber.reason:
                report.add(
                    ERROR,
                    f'{eye.name}: {grabber.reason} (attempts to reopen: {grabber.attempts})',
                )


class _Eye:
    """One camera of the node: where its frames come from, and what they show."""

    def __init__(self, node: PanoramaNode, name: str):
        self.name = name
        self._node = node
        own = Parameters(node, CameraSettings, prefix=f'{name}.').settings
        shared = {
            entry.name: getattr(node.settings, entry.name) for entry in fields(FrameSettings)
        }
        named = {
            entry.name: getattr(own.named(name), entry.name) for entry in fields(CameraSettings)
        }
        self._settings = CaptureSettings(**named, **shared)
        self._raw = ImagePublisher(node, f'{name}/image_raw')
        self._frames = 0
        self.grabber = Grabber(self._settings, self._take, on_change=self._tell)
        camera = calibration_of(self._settings.camera_info_url) or self.grabber.camera
        if camera is None:
            raise CameraFileError(
                f'{name}.camera_info_url is empty; expected the calibration file of {own.source} '
                '(calibrate_lens makes one)'
            )
        self._lens = camera.lens
        self._circle = ImageCircle(self._lens)
        self.place(node.settings)

    def place(self, settings: PanoramaSettings) -> None:
        """Say what the camera's pictures show, as far as its light reaches."""
        lens = self._lens.seen_within(self._circle.angle_rad)
        self._node.live.place(self.name, lens, settings.surface_of(lens), settings.interpolation)

    def _take(self, frame) -> None:
        # The image circle does not change: look ever more seldom.
        self._frames += 1
        if self._frames & (self._frames - 1) == 0 and self._circle.look(frame.image):
            self.place(self._node.settings)
        encoding = self._settings.encoding
        self._node.take(self.name, frame.stamp_ns, frame.image, encoding)
        if self._raw.wanted:
            header = Header(stamp=stamp_of(frame.stamp_ns), frame_id=self._settings.frame_id)
            message = to_message(frame.image, encoding, header)
            self._raw.publish(message, frame.image, self._node.settings.jpeg_quality)

    def _tell(self, reason: str) -> None:
        if reason:
            self._node.warn(f'{self.name}: no pictures: {reason}')
        else:
            self._node.get_logger().info(f'{self.name}: pictures come')


def main() -> int:
    """Run the node."""
    return run(PanoramaNode)
