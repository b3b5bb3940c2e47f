"""Where the panorama node's frames come from: its own cameras, and those that other nodes read."""

from dataclasses import fields

import numpy as np
from std_msgs.msg import Header

from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import ERROR, WARN, DropCounter, Report
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.stamps import ns_of, stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.calibration_url import calibration_of, calibration_path
from fisheye_capture.capture_settings import CameraSettings, CaptureSettings, FrameSettings
from fisheye_capture.region import AnyFrame, region_named
from fisheye_capture.source import shown_source
from fisheye_core.errors import CameraFileError, FisheyeError
from fisheye_geometry.camera import Camera
from fisheye_geometry.image_circle import LensWithImageCircle
from fisheye_geometry.lens import Lens
from fisheye_undistort.report.calibrated_angle import calibrated_deg
from panorama_stitch.compose.seam_angle import seam_angle_rad
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.nodes.frame_reader import TOPIC, Reader, reader_for
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings


class CameraInput:
    """One camera of the panorama node: what its frames show, and where they go."""

    lens: Lens | None

    def __init__(self, node: PanoramaBase, name: str):
        self._node, self._name = node, name

    def check(self, settings: PanoramaSettings) -> None:
        """Raise a `GeometryError` if the camera's pictures cannot be shown like that."""
        if self.lens:
            settings.surface_of(self.lens)

    def place(self, settings: PanoramaSettings) -> None:
        """Place the camera in the pipeline, if what its images show is known."""
        if self.lens:
            surface = settings.surface_of(self.lens)
            self._node.pipeline.place(self._name, self.lens, surface, settings.interpolation)


class LocalCamera(CameraInput):
    """A camera whose calibration the node reads itself: all of a reader's frames, or a region."""

    def __init__(self, node: PanoramaBase, name: str, own: CaptureSettings, reader: Reader):
        super().__init__(node, name)
        self._settings = own
        self._region = region_named(own.region, f'{name}.region')
        is_topic = own.source == TOPIC
        self._raw = None if is_topic else ImagePublisher(node, f'{name}/image_raw')
        camera = self._calibration(reader)
        self._camera, self._seen, self._fault = camera, LensWithImageCircle(camera.lens), ''
        file = calibration_path(own.camera_info_url, own.camera_name)
        self._calibrated_deg = calibrated_deg(file, camera.lens) if file else None
        self._broken = DropCounter(node, f'a picture of {name}', f'{name} broken')
        self.place(node.settings)
        reader.add(name, self._take)

    @property
    def lens(self) -> Lens:
        """What the camera sees, within the circle that the lens lights."""
        return self._seen.lens

    def report(self, report: Report) -> None:
        """Report what is wrong with the camera, and its numbers."""
        faults = (ERROR, self._fault), (WARN, self._seen.note), (WARN, self._beyond)
        for level, sentence in faults:
            if sentence:
                report.add(level, f'{self._name}: {sentence}')
        self._broken.tell(report)

    @property
    def _beyond(self) -> str:
        """A sentence if a seam lies where the lens is not known; '' if not."""
        compositor = self._node.pipeline.compositor
        if compositor is None or self._calibrated_deg is None:
            return ''
        index = self._node.settings.cameras.index(self._name)
        seam_deg = np.degrees(seam_angle_rad(compositor, index))
        if seam_deg <= self._calibrated_deg:
            return ''
        return (
            f'its seam lies {seam_deg:.0f} degrees off the axis of the lens, which is calibrated '
            f'out to {self._calibrated_deg:.0f} degrees; calibrate with views that reach farther'
        )

    def _calibration(self, reader: Reader) -> Camera:
        own = self._settings
        if camera := calibration_of(own.camera_info_url, own.camera_name):
            return camera
        if reader.camera is None:
            raise CameraFileError(
                f'{self._name}.camera_info_url is empty; expected the calibration file of '
                f'{shown_source(own.source)} (calibrate_lens makes one)'
            )
        return self._region.camera(reader.camera) if self._region else reader.camera

    def _take(self, frame: AnyFrame, encoding: str) -> None:
        before = self._fault
        try:
            self._fault = self._region.fault(*frame.size) if self._region else ''
            if self._region and not self._fault:
                frame = self._region.frame(frame)
            self._fault = self._fault or self._camera.size_mismatch(*frame.size)
            if not self._fault:
                self._show(frame, frame.image, encoding)
            elif not before:
                self._node.warn(f'{self._name}: {self._fault}')
        except FisheyeError as error:
            self._broken.add(error)

    def _show(self, frame: AnyFrame, image: np.ndarray, encoding: str) -> None:
        noted = self._seen.note
        if self._seen.look(image):
            self.place(self._node.settings)
        if self._seen.note and not noted:
            self._node.warn(f'{self._name}: {self._seen.note}')
        self._node.pipeline.take(self._name, frame.stamp_ns, image, encoding)
        if self._raw and self._raw.wanted:
            header = Header(stamp=stamp_of(frame.stamp_ns), frame_id=self._settings.frame_id)
            quality = self._node.settings.jpeg_quality
            self._raw.publish_picture(frame, encoding, header, quality)


class RemoteCamera(CameraInput):
    """A camera that another node reads, and describes with camera_info."""

    def __init__(self, node: PanoramaBase, name: str, region: str):
        super().__init__(node, name)
        self._region = region_named(region, f'{name}.region')
        self._camera = CameraSubscription(
            node,
            on_picture=self._take,
            on_lens=lambda lens, header: self.place(node.settings),
            check=lambda lens: node.settings.surface_of(lens),
            namespace=name,
            transport=node.settings.transport,
            cut=self._region.cut if self._region else None,
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


def camera_inputs(node: PanoramaBase) -> tuple[list[CameraInput], list[Reader]]:
    """Return the inputs of a node's cameras, as their parameters say, and what reads for them.

    Raises
    ------
    FisheyeError
        If a source or a calibration can never work.
    """
    inputs: list[CameraInput] = []
    readers: dict[str, Reader] = {}
    for name in node.settings.cameras:
        own = _capture_settings(node, name)
        if own.source == TOPIC and not (own.region and own.camera_info_url):
            inputs.append(RemoteCamera(node, name, own.region))
            continue
        reader = reader_for(readers, node, name, own)
        inputs.append(LocalCamera(node, name, own, reader))
    return inputs, list(readers.values())


def _capture_settings(node: PanoramaBase, name: str) -> CaptureSettings:
    """Return the settings of a camera and those that all have in common."""
    own = Parameters(node, CameraSettings, prefix=f'{name}.').settings.named(name)
    return CaptureSettings(
        **{entry.name: getattr(own, entry.name) for entry in fields(CameraSettings)},
        **{entry.name: getattr(node.settings, entry.name) for entry in fields(FrameSettings)},
    )
