"""How far a lens is known: the angles it may be off by over the picture, and where too much."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_undistort.fit.angle_map import lit_part, place_name
from fisheye_undistort.fit.calibration import Calibration
from fisheye_undistort.report.misfit import Misfit, misfit_of

LIMIT_DEG = 0.5
"""A lens that may be off by more is not good there: a seam shows less."""
_DEVIATIONS = 2.0
"""`off_deg` in standard deviations; they are generous, see `NormalEquations.covariance`."""
_SEAM_MARGIN_DEG = 3.0
"""Views are joined over some width: what must be known beyond a seam."""
_NEAR_DEG = 3.0
"""Points that near are points there."""
_UNKNOWN_DEG = 90.0
"""Written where light comes from and the lens sees nothing."""


@dataclass(frozen=True)
class Gap:
    """A part of the picture where the lens is not known well enough.

    Attributes
    ----------
    place
        `left edge`, `top right corner`, ...
    off_deg
        How much the lens may be off there.
    empty_deg
        How far away the nearest point is.
    """

    place: str
    off_deg: float
    empty_deg: float

    def __str__(self):
        off = (
            'where the distortion ends before the picture does'
            if self.off_deg >= _UNKNOWN_DEG
            else f'where the lens may be off by {self.off_deg:.2g} degrees'
        )
        if self.empty_deg < _NEAR_DEG:
            return f'too few points at the {self.place}, {off}'
        return f'nothing within {self.empty_deg:.0f} degrees of the {self.place}, {off}'


@dataclass(frozen=True)
class Certainty:
    """What is known of a lens over the picture.

    Attributes
    ----------
    calibration
        What is judged.
    brightest
        (height, width) uint8, the brightest that each pixel was.
    seam_deg
        Angle from the axis that must be known; 0: all that the picture shows.
    """

    calibration: Calibration
    brightest: np.ndarray
    seam_deg: float = 0.0

    @cached_property
    def lit(self) -> np.ndarray:
        """Where the picture shows something, (30, 40) bool."""
        return lit_part(self.brightest)

    @cached_property
    def misfit(self) -> Misfit:
        """What the model leaves."""
        return misfit_of(self.calibration)

    @cached_property
    def off_deg(self) -> np.ndarray:
        """How much the lens may be off at each point (30, 40) of the grid; NaN where no light is.

        From the covariance, so also from the scatter between views and between both halves, and
        from what the model leaves.
        """
        deviation = self.calibration.angles.deviation_rad(self.calibration.covariance)
        off = np.degrees(_DEVIATIONS * np.hypot(deviation, self.misfit.typical_rad))
        off = np.where(self.calibration.angles.seen, off, _UNKNOWN_DEG).clip(0, _UNKNOWN_DEG)
        return np.where(self.lit, off, np.nan)

    @cached_property
    def empty_deg(self) -> np.ndarray:
        """Angle (30, 40) from each point of the grid to the nearest point of the target."""
        angle, azimuth = self.calibration.directions_rad
        side = np.sin(angle)
        points = np.stack([side * np.cos(azimuth), side * np.sin(azimuth), np.cos(angle)])
        near = (self._rays @ points).max(axis=-1)
        return np.degrees(np.arccos(near.clip(-1, 1)))

    @property
    def _rays(self) -> np.ndarray:
        """Rays (30, 40, 3); where the lens sees nothing: those at its end in that direction."""
        angles, lens = self.calibration.angles, self.calibration.lens
        x, y = np.moveaxis(angles.pixels - (lens.center_x_px, lens.center_y_px), -1, 0)
        azimuth, end = np.arctan2(y, x), lens.max_angle_rad
        side = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1) * np.sin(end)
        last = np.concatenate([side, np.full((*side.shape[:2], 1), np.cos(end))], axis=-1)
        return np.where(angles.seen[..., None], angles.rays, last)

    @cached_property
    def angle_deg(self) -> np.ndarray:
        """Angle (30, 40) from the axis; where the lens sees nothing: that of its end."""
        angle = self.calibration.angles.angle_rad
        return np.degrees(np.where(np.isfinite(angle), angle, self.calibration.lens.max_angle_rad))

    @cached_property
    def calibrated_deg(self) -> float:
        """Angle from the axis up to which the lens is known all around."""
        doubtful = self.off_deg > LIMIT_DEG
        if doubtful.any():
            return float(self.angle_deg[doubtful].min())
        return float(self.angle_deg[self.lit].max()) if self.lit.any() else 0.0

    @cached_property
    def gaps(self) -> list[Gap]:
        """Parts of the picture that are not known well enough, the worst first."""
        needed = self.angle_deg <= self.seam_deg + _SEAM_MARGIN_DEG if self.seam_deg else self.lit
        worst: dict[str, Gap] = {}
        for row, column in np.argwhere(needed & (self.off_deg > LIMIT_DEG)):
            x, y = self.calibration.angles.pixels[row, column]
            off, empty = self.off_deg[row, column], self.empty_deg[row, column]
            place = place_name(x, y, self.brightest.shape)
            if place not in worst or off > worst[place].off_deg:
                worst[place] = Gap(place, float(off), float(empty))
        return sorted(worst.values(), key=lambda gap: -gap.off_deg)

    def by_angle(self, edges_deg: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Median and most (N - 1,) of `off_deg` between angles (N,); NaN where nothing is."""
        middle, most = np.full((2, len(edges_deg) - 1), np.nan)
        ring = np.digitize(self.angle_deg, edges_deg) - 1
        for number in range(len(middle)):
            inside = self.off_deg[(ring == number) & self.lit]
            if len(inside):
                middle[number], most[number] = np.median(inside), inside.max()
        return middle, most
