"""Virtual cameras: what looks out from within the rig, without distortion."""

from dataclasses import dataclass
from math import radians, tan

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import Lens, make_lens
from fisheye_geometry.surface import Surface

_NO_DISTORTION = (0.0,) * 5


@dataclass(frozen=True)
class VirtualCamera:
    """A camera without distortion that looks somewhere in the panorama's frame.

    Attributes
    ----------
    yaw_rad, pitch_rad
        To the right and up, rad.
    hfov_rad
        Horizontal field of view, from the left edge of the picture to its right one, rad.
    width, height
        Size of its picture, px.
    """

    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    hfov_rad: float = radians(90)
    width: int = 640
    height: int = 480

    @property
    def attitude(self) -> Attitude:
        """Attitude of the camera: it takes its rays to rays of the panorama's frame."""
        return Attitude(self.yaw_rad, self.pitch_rad)

    @property
    def surface(self) -> Surface:
        """What its picture shows."""
        focal_px = self.width / 2 / tan(self.hfov_rad / 2)
        center_px = (self.width - 1) / 2, (self.height - 1) / 2
        return Surface('rectilinear', self.width, self.height, focal_px, *center_px)

    @property
    def lens(self) -> Lens:
        """The same as a lens, for `camera_info`."""
        plane = self.surface
        matrix = [plane.focal_px, 0, plane.center_x_px, 0, plane.focal_px, plane.center_y_px]
        return make_lens('plumb_bob', self.width, self.height, [*matrix, 0, 0, 1], _NO_DISTORTION)
