"""The annular lens: a camera that looks into a convex mirror and sees all around."""

from math import pi

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens_model import Lens

_ROUNDING_RAD = 1e-9


class AnnularLens(Lens):
    """Convex mirror in front of a camera, whose picture of everything around is a ring.

    Its frame is that of the mirror: y along the mirror's axis, which stands upright on a level
    rig, and z towards what the picture shows straight above its centre. Along each radius the
    ring shows elevations in equal steps, as mirrors made for it do. `focal_x_px` and
    `focal_y_px` are the outer radius of the ring, `center_x_px` and `center_y_px` its centre.

    The four numbers of `distortion` are the inner radius in units of the outer one, the elevations
    that the inner and the outer edge show, rad, above the horizon positive, and the direction in
    which bearings to the right follow each other in the picture: 1 clockwise (a camera that looks
    down into its mirror), -1 counterclockwise (one that looks up).

    References
    ----------
    Chahl and Srinivasan, "Reflective surfaces for panoramic imaging", Applied Optics 36(31), 1997,
    doi 10.1364/AO.36.008275.
    """

    model = 'annular'
    coefficient_counts = (4,)
    has_image_circle = False

    def __post_init__(self) -> None:
        super().__post_init__()
        inner, first, last, direction = self.distortion
        if not 0 < inner < 1:
            raise CalibrationError(
                f'the inner radius of an annular lens is {inner:g} outer ones; expected a number '
                'between 0 and 1'
            )
        if first == last or max(abs(first), abs(last)) >= pi / 2:
            raise CalibrationError(
                f'the edges of an annular lens show elevations of {first:g} and {last:g} rad; '
                'expected different ones between -1.57 and 1.57 rad'
            )
        if direction not in (1.0, -1.0):
            raise CalibrationError(
                f'the direction of an annular lens is {direction:g}; expected 1 (clockwise) or '
                '-1 (counterclockwise)'
            )

    @property
    def max_angle_rad(self) -> float:
        """It sees behind itself, too."""
        return pi

    @property
    def elevations_rad(self) -> tuple[float, float]:
        """Lowest and highest elevation that it sees."""
        _, first, last, _ = self.distortion
        return min(first, last), max(first, last)

    def field_rad(self) -> tuple[float, float, float, float]:
        """As `Lens`: all around, and as far up and down as the ring shows."""
        lowest, highest = self.elevations_rad
        return pi, pi, highest, -lowest

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As `Lens`; what is seen lies between two elevations."""
        pixels, _ = super().project(rays)
        x, y, z = np.moveaxis(np.asarray(rays, float), -1, 0)
        elevation = np.arctan2(-y, np.hypot(x, z))
        lowest, highest = self.elevations_rad
        seen = (elevation >= lowest - _ROUNDING_RAD) & (elevation <= highest + _ROUNDING_RAD)
        return pixels, seen

    def _distort(self, rays: np.ndarray) -> np.ndarray:
        x, y, z = np.moveaxis(rays, -1, 0)
        inner, first, last, direction = self.distortion
        share = (np.arctan2(-y, np.hypot(x, z)) - first) / (last - first)
        radius = inner + share * (1 - inner)
        bearing = direction * np.arctan2(x, z)
        return np.stack([radius * np.sin(bearing), -radius * np.cos(bearing)], axis=-1)

    def _undistort(self, normalized: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = np.moveaxis(normalized, -1, 0)
        inner, first, last, direction = self.distortion
        share = (np.hypot(u, v) - inner) / (1 - inner)
        seen = (share >= -_ROUNDING_RAD) & (share <= 1 + _ROUNDING_RAD)
        elevation = first + share.clip(0, 1) * (last - first)
        bearing = direction * np.arctan2(u, -v)
        flat = np.cos(elevation)
        rays = [flat * np.sin(bearing), -np.sin(elevation), flat * np.cos(bearing)]
        return np.stack(rays, axis=-1), seen
