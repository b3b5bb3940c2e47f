"""Stitches corrected images of several cameras into one panorama."""

import numpy as np
from fisheye_msgs.msg import Projection
from std_msgs.msg import Header

from fisheye_bridge.diagnostics import Report
from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import LATCHED
from fisheye_bridge.running import run
from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_core.errors import FisheyeError
from fisheye_geometry.settling import Settling
from fisheye_geometry.surface import Surface
from panorama_stitch.nodes.base_node import PanoramaBase
from panorama_stitch.pipeline.panorama_settings import MountSettings, PanoramaOutputSettings
from panorama_stitch.pipeline.view_settings import ViewSettings


class StitchNode(PanoramaBase):
    """CAMERA/image_rect and CAMERA/projection of each camera to panorama/image."""

    SETTINGS = (('', PanoramaOutputSettings), ('CAMERA.', MountSettings), ('VIEW.', ViewSettings))

    def __init__(self, **kwargs):
        super().__init__('stitch', PanoramaOutputSettings, **kwargs)
        self._inputs = [CorrectedCamera(self, camera) for camera in self.settings.cameras]

    def _report(self, report: Report) -> None:
        super()._report(report)
        for camera in self._inputs:
            camera.images.dropped.tell(report)


class CorrectedCamera:
    """A camera whose corrected images another node publishes.

    Attributes
    ----------
    images : ImageSubscription
        Its images; those that were not usable are counted there.
    """

    def __init__(self, node: StitchNode, name: str):
        self._node, self._name = node, name
        self._is_placed = False
        self._announced: Surface | None = None
        self._settling = Settling()
        node.create_subscription(Projection, f'{name}/projection', self._take_projection, LATCHED)
        self.images = ImageSubscription(
            node, f'{name}/image_rect', self._take_image, key=f'{name} refused'
        )

    def _take_projection(self, message: Projection) -> None:
        """Use the first projection at once, another one when an image of its size comes."""
        try:
            surface = surface_of(message)
        except FisheyeError as error:
            self._node.warn(f'{self._name}/projection refused: {error}')
            return
        if self._is_placed:
            self._announced = surface
        else:
            self._place(surface)

    def _take_image(self, image: np.ndarray, encoding: str, header: Header) -> None:
        surface = self._announced
        fits = surface and image.shape[:2] == (surface.height, surface.width)
        if fits and self._settling.follow():
            self._place(surface)
        self._node.pipeline.take(self._name, ns_of(header.stamp), image, encoding)

    def _place(self, surface: Surface) -> None:
        self._node.pipeline.place(self._name, surface, surface)
        self._is_placed, self._announced = True, None


def main() -> int:
    """Run the node."""
    return run(StitchNode)
