"""One camera as a node: its pictures, and beside each what the camera sees."""

from rclpy.node import Node
from sensor_msgs.msg import CameraInfo
from sensor_msgs.srv import SetCameraInfo
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of, camera_of
from fisheye_bridge.diagnostics import ERROR, WARN, Diagnostics, DropCounter, OverloadMonitor
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.qos import IMAGE
from fisheye_bridge.running import run
from fisheye_bridge.stamps import stamp_of
from fisheye_bridge.topics import ImagePublisher
from fisheye_bridge.video_publisher import VideoPublisher
from fisheye_capture.calibration_url import calibration_path
from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.grabber import Grabber
from fisheye_capture.region import region_named
from fisheye_capture.source import Frame, JpegFrame, shown_source
from fisheye_core.errors import CalibrationError, FisheyeError, SettingError
from fisheye_core.latest_only import LatestOnlyWorker
from fisheye_core.yaml_file import is_missing
from fisheye_geometry.camera_file import Camera, read_camera, write_camera


class CaptureNode(Node):
    """A source of pictures to image_raw and camera_info."""

    SETTINGS = (('', CaptureSettings),)

    def __init__(self, **kwargs):
        super().__init__('capture', **kwargs)
        self._declared = Parameters(self, CaptureSettings)
        name = self.get_namespace().rsplit('/', 1)[-1] or 'camera'
        self._settings = self._declared.settings.named(name)
        self._calibration_path = calibration_path(
            self._settings.camera_info_url, self._settings.camera_name
        )
        self._region = region_named(self._settings.region)
        self._image = ImagePublisher(self, 'image_raw')
        self._video = VideoPublisher(self, 'image_raw', 'image_raw/video')
        self._camera_info = self.create_publisher(CameraInfo, 'camera_info', IMAGE)
        self._info, self._described, self._fault = CameraInfo(), None, ''
        self._broken = DropCounter(self, 'a picture', 'pictures broken')
        self._publishing = LatestOnlyWorker(self._publish, 'publish')
        self._shedding = OverloadMonitor('pictures')
        self._grabber = Grabber(self._settings, self._publishing.put, on_change=self._tell)
        self._camera = self._calibration()
        self.create_service(SetCameraInfo, 'set_camera_info', self._set_camera_info)
        self._diagnostics = Diagnostics(self, self._report)
        self._grabber.start()

    def destroy_node(self) -> None:
        """Release the camera and end the threads too."""
        self._grabber.stop()
        self._publishing.stop()
        self._video.stop()
        super().destroy_node()

    def _calibration(self) -> Camera | None:
        """Return the camera of the calibration file, else what the source knows of itself."""
        path = self._calibration_path
        if path is None:
            camera = self._grabber.camera
            return self._region.camera(camera) if camera and self._region else camera
        if is_missing(path):
            self.get_logger().warning(f'{path} is not there yet; set_camera_info writes it')
            return None
        return read_camera(path)

    def _publish(self, frame: Frame | JpegFrame) -> None:
        settings = self._declared.settings
        header = Header(stamp=stamp_of(frame.stamp_ns), frame_id=self._settings.frame_id)
        try:
            shown = self._region.frame(frame) if self._region else frame
            if self._described != (self._camera, *shown.size):
                self._describe(self._camera, *shown.size)
            self._image.publish_picture(shown, settings.encoding, header, settings.jpeg_quality)
            if self._video.wanted:
                self._video.put(shown.image, settings.encoding, header, settings)
        except FisheyeError as error:
            self._broken.add(error)
            return
        self._info.header = header
        self._camera_info.publish(self._info)

    def _describe(self, camera: Camera | None, width: int, height: int) -> None:
        """Prepare the camera_info of pictures of this size; without K if it is not known."""
        self._described = camera, width, height
        self._fault = (
            camera.size_mismatch(width, height) if camera else 'the camera is not calibrated'
        )
        if camera and not self._fault:
            self._info = camera_info_of(camera, Header())
        else:
            self._info = CameraInfo(width=width, height=height)
            self.get_logger().warning(f'{self._fault}: camera_info is published without K')

    def _set_camera_info(self, request, response):
        """Write the calibration file and use it from the next picture on."""
        try:
            if self._calibration_path is None:
                raise SettingError('camera_info_url is empty; expected the file to write')
            camera = camera_of(request.camera_info, self._settings.camera_name)
            if self._described and (mismatch := camera.size_mismatch(*self._described[1:])):
                raise CalibrationError(mismatch)
            write_camera(self._calibration_path, camera)
        except FisheyeError as error:
            response.success, response.status_message = False, str(error)
            return response
        self._camera = camera
        response.success, response.status_message = True, f'written to {self._calibration_path}'
        return response

    def _tell(self, reason: str) -> None:
        if reason:
            self.get_logger().warning(self._grabber.news(reason))
        else:
            self.get_logger().info(self._grabber.news(reason))

    def _report(self, report) -> None:
        grabber = self._grabber
        if grabber.complaint:
            report.add(ERROR, grabber.complaint)
        if grabber.note:
            report.add(WARN, grabber.note)
        if damage := grabber.damage():
            report.add(WARN, damage)
        if self._fault:
            report.add(ERROR if self._camera else WARN, self._fault)
        report.values['source'] = shown_source(self._settings.source)
        report.values['rate Hz'] = grabber.rate.hz
        report.values['pictures'] = grabber.frames
        dropped = self._publishing.dropped
        skipped = grabber.skipped + dropped
        self._shedding.tell(report, grabber.frames - dropped, skipped)
        report.values['pictures skipped'] = skipped
        report.values['pictures damaged'] = grabber.damaged
        self._broken.tell(report)
        self._video.report(report)


def main() -> int:
    """Run the node."""
    return run(CaptureNode)
