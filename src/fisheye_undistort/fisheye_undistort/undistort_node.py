"""Corrects the pictures of one camera with cached maps."""

from fisheye_msgs.msg import Projection
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image

from fisheye_bridge.camera_info import camera_of
from fisheye_bridge.diagnostics import ERROR, WARN, Diagnostics
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_bridge.running import run
from fisheye_bridge.topics import WARNING_PAUSE_S, ImageSubscription
from fisheye_geometry.background import Background
from fisheye_geometry.errors import CalibrationError, FisheyeError
from fisheye_geometry.image_circle import ImageCircle
from fisheye_undistort.correction import Correction
from fisheye_undistort.settings import UndistortSettings


class UndistortNode(Node):
    """image_raw and camera_info to image_rect and projection."""

    def __init__(self, **kwargs):
        super().__init__('undistort', **kwargs)
        self._background = Background(self._refuse)
        self._camera_info = self._camera = self._circle = self._asked = None
        self._correction = self._buffer = self._picture_size = None
        self._refusal, self._refusal_is_over = '', False
        self._frames = self._corrected = 0
        self._declared = Parameters(self, UndistortSettings, on_change=self._rebuild)
        self._image = self.create_publisher(Image, 'image_rect', IMAGE)
        self._projection = self.create_publisher(Projection, 'projection', LATCHED)
        self._input = ImageSubscription(
            self, 'image_raw', self._take_image, transport=self._declared.settings.transport
        )
        self.create_subscription(CameraInfo, 'camera_info', self._take_camera_info, IMAGE)
        self._diagnostics = Diagnostics(self, self._report)

    def _take_camera_info(self, message):
        """Have the maps rebuilt, but only if the camera is another one than before."""
        content = (message.width, message.height, message.distortion_model, *message.k, *message.d)
        if repr(content) == self._camera_info:
            self._refusal_is_over = True
            if not self._frames:
                # No picture comes that could show where the lens's light ends.
                self._rebuild(self._declared.settings)
            return
        try:
            camera = self._checked(camera_of(message))
        except FisheyeError as error:
            self._refuse(error)
            return
        self._camera_info, self._camera, self._header = repr(content), camera, message.header
        self._circle = ImageCircle(camera.lens)
        self._frames = 0

    def _checked(self, camera):
        """Give the camera back if it fits the pictures and there is a surface for it."""
        size = camera.lens.width, camera.lens.height
        if self._picture_size not in (None, size):
            raise CalibrationError(
                '{}x{} px do not fit the pictures, which have {}x{} px'.format(
                    *size, *self._picture_size
                )
            )
        self._declared.settings.surface_of(camera.lens)
        return camera

    def _rebuild(self, settings):
        """Have the maps built in the background; frames use the old ones until then."""
        if self._camera is None:
            return
        lens = self._camera.lens.seen_within(self._circle.angle_rad)
        settings.surface_of(lens)
        if (lens, settings) != self._asked:
            self._asked = lens, settings
            self._background.do(self._build, lens, settings)

    def _build(self, lens, settings):
        self._correction = Correction(lens, settings)
        self._refusal = ''
        self._projection.publish(projection_of(self._correction.surface, self._header))

    def _refuse(self, error):
        self._refusal, self._refusal_is_over = str(error), False
        kept = '; the last good calibration stays in use' if self._correction else ''
        self.get_logger().warning(
            f'camera_info refused: {error}{kept}', throttle_duration_sec=WARNING_PAUSE_S
        )

    def _take_image(self, image, encoding, header):
        self._picture_size = image.shape[1::-1]
        self._look_for_circle(image)
        correction = self._correction
        if correction is None or not self._image.get_subscription_count():
            return
        surface = correction.surface
        if self._buffer is None or not self._buffer.fits(surface.width, surface.height, encoding):
            self._buffer = ImageBuffer(surface.width, surface.height, encoding)
        correction(image, self._buffer.array)
        self._buffer.message.header = header
        self._image.publish(self._buffer.message)
        self._corrected += 1

    def _look_for_circle(self, image):
        """Look where the lens's light ends; ever more seldom, since it does not change."""
        self._frames += 1
        power_of_two = self._frames & (self._frames - 1) == 0
        if self._circle and power_of_two and (self._circle.look(image) or self._frames == 1):
            self._rebuild(self._declared.settings)

    def _report(self, report):
        if self._correction is None:
            report.add(ERROR, self._refusal or 'waiting for camera_info')
        elif self._refusal:
            report.add(WARN, f'camera_info refused: {self._refusal}')
        if self._refusal_is_over:
            self._refusal = ''
        if self._input.refused:
            report.values['pictures refused'] = self._input.refused
        report.values['pictures corrected'] = self._corrected

    def destroy_node(self):
        """End the background work too."""
        self._background.stop()
        super().destroy_node()


def main() -> int:
    """Run the node."""
    return run(UndistortNode)
