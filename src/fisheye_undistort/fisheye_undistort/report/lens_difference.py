"""How two calibrations of one camera differ."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_core.errors import SettingError
from fisheye_geometry.attitude import angle_between
from fisheye_geometry.lens import Lens
from fisheye_undistort.fit.angle_map import difference_rad, picture_grid

_RING_DEG = 10


@dataclass(frozen=True)
class LensDifference:
    """Angles between the rays of two lenses, the rotation between both cameras taken out.

    Raises
    ------
    SettingError
        If the lenses are not of one size, or see nothing in common.
    """

    one: Lens
    other: Lens

    def __post_init__(self):
        sizes = [(lens.width, lens.height) for lens in (self.one, self.other)]
        if sizes[0] != sizes[1]:
            raise SettingError(
                f'the calibrations are for {sizes[0][0]}x{sizes[0][1]} and '
                f'{sizes[1][0]}x{sizes[1][1]} px; expected one size'
            )
        if not np.isfinite(self.apart_deg).any():
            raise SettingError('the lenses see no pixel in common')

    @property
    def pixels(self) -> np.ndarray:
        """Pixels (30, 40, 2) at which the lenses are compared."""
        return picture_grid((self.one.width, self.one.height))

    @cached_property
    def _difference(self) -> tuple[np.ndarray, np.ndarray]:
        apart, rotation = difference_rad(self.one, self.other, self.pixels, turned=True)
        return np.degrees(apart), rotation

    @property
    def apart_deg(self) -> np.ndarray:
        """Angles (30, 40), degrees; NaN where either lens sees nothing."""
        return self._difference[0]

    @property
    def turned_deg(self) -> float:
        """Angle of the rotation that was taken out."""
        return float(np.degrees(angle_between(np.eye(3), self._difference[1])))

    @property
    def angle_deg(self) -> np.ndarray:
        """Angle (30, 40) from the axis of the first lens; NaN where it sees nothing."""
        rays, seen = self.one.unproject(self.pixels)
        return np.degrees(np.where(seen, np.arccos(rays[..., 2].clip(-1, 1)), np.nan))

    def __str__(self):
        apart, angle = self.apart_deg, self.angle_deg
        lines = [
            f'difference up to {np.nanmax(apart):.3f} degrees, rms '
            f'{np.sqrt(np.nanmean(apart**2)):.3f}, after a rotation of {self.turned_deg:.3f}'
        ]
        for ring in range(0, 180, _RING_DEG):
            inside = (angle >= ring) & (angle < ring + _RING_DEG) & np.isfinite(apart)
            if inside.any():
                span = f'{ring}-{ring + _RING_DEG}'
                rms = np.sqrt(np.mean(apart[inside] ** 2))
                lines.append(f'  {span:>7} deg  up to {apart[inside].max():.3f}, rms {rms:.3f}')
        return '\n'.join(lines)
