"""Stitches corrected pictures of several cameras into one panorama."""

from fisheye_msgs.msg import Projection

from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import LATCHED
from fisheye_bridge.running import run
from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_core.errors import FisheyeError
from fisheye_geometry.settling import Settling
from fisheye_geometry.surface import Surface
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.pipeline.panorama_settings import StitchSettings


class StitchNode(PanoramaBase):
    """CAMERA/image_rect and CAMERA/projection of each camera to panorama/image."""

    SETTINGS = (('', StitchSettings),)

    def __init__(self, **kwargs):
        super().__init__('stitch', StitchSettings, **kwargs)
        self._eyes = [_Eye(self, camera) for camera in self.settings.cameras]

    def _report(self, report) -> None:
        super()._report(report)
        for eye in self._eyes:
            eye.pictures.dropped.tell(report)


class _Eye:
    """One camera of the node: its corrected pictures, and what they show."""

    def __init__(self, node: StitchNode, name: str):
        self.name = name
        self._node = node
        self._is_placed, self._announced = False, None
        self._settling = Settling()
        node.create_subscription(Projection, f'{name}/projection', self._take_projection, LATCHED)
        self.pictures = ImageSubscription(
            node, f'{name}/image_rect', self._take_image, key=f'{name} refused'
        )

    def _take_projection(self, message) -> None:
        """Take the first projection at once, another one when a picture of its size comes."""
        try:
            surface = surface_of(message)
        except FisheyeError as error:
            self._node.warn(f'{self.name}/projection refused: {error}')
            return
        if self._is_placed:
            self._announced = surface
        else:
            self._place(surface)

    def _take_image(self, image, encoding, header) -> None:
        surface = self._announced
        fits = surface and image.shape[:2] == (surface.height, surface.width)
        if fits and self._settling.follow():
            self._place(surface)
        self._node.take(self.name, ns_of(header.stamp), image, encoding)

    def _place(self, surface: Surface) -> None:
        self._node.live.place(self.name, surface, surface)
        self._is_placed, self._announced = True, None


def main() -> int:
    """Run the node."""
    return run(StitchNode)
