"""Corrects the pictures of one camera with cached maps."""

from fisheye_msgs.msg import Projection
from rclpy.node import Node
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import Diagnostics
from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.parameters import Parameters
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_bridge.running import run
from fisheye_core.background import Background
from fisheye_geometry.lens import Lens
from fisheye_undistort.correction import Correction
from fisheye_undistort.undistort_settings import UndistortSettings


class UndistortNode(Node):
    """image_raw and camera_info to image_rect and projection."""

    SETTINGS = (('', UndistortSettings),)

    def __init__(self, **kwargs):
        super().__init__('undistort', **kwargs)
        self._correction: Correction | None = None
        self._buffer: ImageBuffer | None = None
        self._asked: tuple[Lens, UndistortSettings] | None = None
        self._header = Header()
        self._corrected = 0
        self._declared = Parameters(self, UndistortSettings, on_change=self._rebuild)
        self._image = self.create_publisher(Image, 'image_rect', IMAGE)
        self._projection = self.create_publisher(Projection, 'projection', LATCHED)
        self._camera = CameraSubscription(
            self,
            on_picture=self._correct,
            on_lens=self._take_lens,
            check=lambda lens: self._declared.settings.surface_of(lens),
            transport=self._declared.settings.transport,
        )
        self._background = Background(self._camera.refuse)
        self._diagnostics = Diagnostics(self, self._report)

    def destroy_node(self):
        """End the background work too."""
        self._background.stop()
        super().destroy_node()

    def _take_lens(self, lens, header):
        self._header = header
        self._rebuild(self._declared.settings)

    def _rebuild(self, settings):
        """Build the maps in the background; frames use the old ones until then."""
        lens = self._camera.lens
        if lens is None:
            return
        settings.surface_of(lens)
        if (lens, settings) != self._asked:
            self._asked = lens, settings
            self._background.do(self._build, lens, settings)

    def _build(self, lens, settings):
        self._correction = Correction(lens, settings)
        self._projection.publish(
            projection_of(self._correction.surface, self._header, orientation=settings.orientation)
        )

    def _correct(self, image, encoding, header):
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

    def _report(self, report):
        self._camera.report(report, is_used=self._correction is not None)
        report.values['pictures corrected'] = self._corrected


def main() -> int:
    """Run the node."""
    return run(UndistortNode)
