"""Lenses that are not of Kannala and Brandt, for pictures that ours must fit or confess not to."""

from functools import cached_property
from math import pi

import numpy as np

from fisheye_geometry.lens import Lens

_TABLE = 40_000


class RadialLens(Lens):
    """Lens with any radius that grows with the angle; the inverse is a table."""

    coefficient_counts = (0,)

    def _radius(self, angle: np.ndarray) -> np.ndarray:
        raise NotImplementedError

    @cached_property
    def _table(self) -> tuple[np.ndarray, np.ndarray]:
        angles = np.linspace(0, min(self.visible_angle_rad, 0.95 * pi), _TABLE)
        radii = self._radius(angles)
        ends = np.flatnonzero(np.diff(radii) <= 0)
        last = ends[0] + 1 if len(ends) else _TABLE
        return angles[:last], radii[:last]

    @property
    def max_angle_rad(self) -> float:
        return float(self._table[0][-1])

    def _distort(self, rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        side = np.hypot(x, y)
        radius = self._radius(np.arctan2(side, z))
        scale = np.divide(radius, side, out=np.zeros_like(side), where=side > 0)
        return np.stack([x * scale, y * scale], axis=-1)

    def _undistort(self, normalized):
        u, v = np.moveaxis(normalized, -1, 0)
        radius = np.hypot(u, v)
        angles, radii = self._table
        angle = np.interp(radius, radii, angles)
        scale = np.divide(np.sin(angle), radius, out=np.ones_like(radius), where=radius > 0)
        return np.stack([u * scale, v * scale, np.cos(angle)], axis=-1), radius <= radii[-1]


class EquisolidLens(RadialLens):
    """Most fisheye lenses of photographers."""

    def _radius(self, angle):
        return 2 * np.sin(angle / 2)


class StereographicLens(RadialLens):
    """Keeps shapes, stretches the edge."""

    def _radius(self, angle):
        return 2 * np.tan(angle / 2)


class DoubleSphereLens(RadialLens):
    """Usenko, Demmel and Cremers 2018, doi 10.1109/3DV.2018.00069; `distortion` is xi, alpha."""

    coefficient_counts = (2,)

    def _radius(self, angle):
        xi, alpha = self.distortion
        raised = xi + np.cos(angle)
        depth = alpha * np.hypot(np.sin(angle), raised) + (1 - alpha) * raised
        return (1 + xi) * np.sin(angle) / depth


class OCamLens(RadialLens):
    """Scaramuzza, Martinelli and Siegwart 2006; `distortion` is a2, a3, a4 for a0 = 1.

    The affine part of that model is `skew_px` and the two focal lengths.
    """

    coefficient_counts = (3,)

    @cached_property
    def _table(self):
        a2, a3, a4 = self.distortion
        radii = np.linspace(0, 4, _TABLE)
        angles = np.arctan2(radii, 1 + a2 * radii**2 + a3 * radii**3 + a4 * radii**4)
        last = np.searchsorted(angles, self.visible_angle_rad)
        return angles[:last], radii[:last]

    def _radius(self, angle):
        angles, radii = self._table
        return np.interp(angle, angles, radii)


def foreign_lens(
    name: str, fov_deg: float, width: int = 640, height: int = 480, *, across: str = 'width'
) -> Lens:
    """Return a lens that lights a circle of `fov_deg`, as wide as the picture or its diagonal.

    Parameters
    ----------
    name
        `equisolid`, `stereographic`, `double_sphere` or `ocam`.
    fov_deg
        Angle across the circle.
    width, height
        Of the picture, px.
    across
        `width` or `diagonal`.
    """
    kind, distortion, skew = {
        'equisolid': (EquisolidLens, (), 0.0),
        'stereographic': (StereographicLens, (), 0.0),
        'double_sphere': (DoubleSphereLens, (-0.2, 0.57), 0.0),
        'ocam': (OCamLens, (-0.32, 0.02, -0.015), 0.0006),
    }[name]
    half = np.radians(fov_deg / 2)
    unit = kind(width, height, 1.0, 1.0, 0.0, 0.0, distortion)
    radius = float(unit.project(np.array([np.sin(half), 0, np.cos(half)]))[0][0])
    reach = {'width': width, 'diagonal': float(np.hypot(width, height))}[across]
    focal = reach / 2 / radius
    center = (width / 2 + 0.004 * width, height / 2 - 0.003 * width)
    return kind(
        width,
        height,
        focal,
        focal * 1.001,
        *center,
        distortion,
        skew_px=skew * focal,
        visible_angle_rad=half,
    )
