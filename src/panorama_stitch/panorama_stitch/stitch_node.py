"""Stitches corrected pictures of several cameras into one panorama."""

from fisheye_msgs.msg import Projection

from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import LATCHED
from fisheye_bridge.running import run
from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_geometry.errors import FisheyeError
from panorama_stitch.base_node import PanoramaBase
from panorama_stitch.settings import StitchSettings


class StitchNode(PanoramaBase):
    """CAMERA/image_rect and CAMERA/projection of each camera to panorama/image."""

    def __init__(self, **kwargs):
        super().__init__('stitch', StitchSettings, **kwargs)
        self._inputs = [self._listen(camera) for camera in self.settings.cameras]

    def _listen(self, camera: str) -> ImageSubscription:
        def take_image(image, encoding, header):
            self.take(camera, ns_of(header.stamp), image, encoding)

        def take_projection(message):
            try:
                surface = surface_of(message)
                self.live.place(camera, surface, surface)
            except FisheyeError as error:
                self._warn(f'{camera}/projection refused: {error}')

        self.create_subscription(Projection, f'{camera}/projection', take_projection, LATCHED)
        return ImageSubscription(self, f'{camera}/image_rect', take_image)


def main() -> int:
    """Run the node."""
    return run(StitchNode)
