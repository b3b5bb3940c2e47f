"""What a lens model leaves: residuals that all views share, by ring and sector."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fisheye_undistort.fit.calibration import Calibration

RING_DEG = 10
"""Width of the rings about the axis."""
DIRECTIONS = (
    'to the right',
    'to the bottom right',
    'to the bottom',
    'to the bottom left',
    'to the left',
    'to the top left',
    'to the top',
    'to the top right',
)
"""Where the sectors lie in the picture."""
SECTORS = len(DIRECTIONS)

_FEWEST_VIEWS = 4
"""Views that must have points in a cell before it says anything."""
_SURE = 3.0
"""Standard errors from 0 at which a mean residual is no chance."""


@dataclass(frozen=True)
class Misfit:
    """Mean residuals of the cells in which enough views have points.

    Attributes
    ----------
    ring_deg
        (C,) inner angle of each cell's ring.
    sector
        (C,) int, from the right clockwise.
    mean_px
        (C, 2) outwards, and clockwise as the camera sees it.
    error_px
        (C,) standard error of `mean_px`, from the scatter between the views.
    px_per_rad
        (C,) how far the picture moves with the angle there.
    """

    ring_deg: np.ndarray
    sector: np.ndarray
    mean_px: np.ndarray
    error_px: np.ndarray
    px_per_rad: np.ndarray

    @property
    def size_px(self) -> np.ndarray:
        """Length (C,) of what is systematic, without what chance adds; 0 where it may be all."""
        length = np.linalg.norm(self.mean_px, axis=-1)
        excess = np.sqrt((length**2 - self.error_px**2).clip(0))
        return np.where(length > _SURE * self.error_px, excess, 0.0)

    @property
    def typical_px(self) -> float:
        """Root mean square of `size_px`."""
        return float(np.sqrt(np.mean(self.size_px**2))) if len(self.sector) else 0.0

    @property
    def typical_rad(self) -> float:
        """The same as an angle."""
        sizes = self.size_px / self.px_per_rad
        return float(np.sqrt(np.mean(sizes**2))) if len(sizes) else 0.0

    @property
    def worst(self) -> int | None:
        """Index of the cell with the most; None if none is systematic."""
        return int(np.argmax(self.size_px)) if self.size_px.any() else None


def sector_of(azimuth_rad: np.ndarray) -> np.ndarray:
    """Which of `SECTORS` an angle about the axis lies in; the first is to the right."""
    return ((azimuth_rad / (2 * np.pi) + 1) * SECTORS + 0.5).astype(int) % SECTORS


def misfit_of(calibration: Calibration) -> Misfit:
    """Return what the residuals of a calibration have in common."""
    angle, azimuth = calibration.directions_rad
    residuals = np.concatenate(calibration.estimate.residuals_px)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth)], axis=-1)
    around = np.stack([-outward[:, 1], outward[:, 0]], axis=-1)
    parts = np.stack([np.sum(residuals * axis, axis=-1) for axis in (outward, around)], axis=-1)
    view = np.repeat(np.arange(len(calibration.views)), [len(v.ids) for v in calibration.views])
    cell = (np.degrees(angle) // RING_DEG).astype(int) * SECTORS + sector_of(azimuth)
    slope = _px_per_rad(calibration.lens, angle)
    rows = []
    for number in np.unique(cell):
        inside = cell == number
        means = np.array(
            [parts[inside & (view == v)].mean(axis=0) for v in np.unique(view[inside])]
        )
        if len(means) >= _FEWEST_VIEWS:
            error = np.sqrt(means.var(axis=0, ddof=1).sum() / len(means))
            ring, sector = divmod(int(number), SECTORS)
            rows.append((ring * RING_DEG, sector, means.mean(axis=0), error, slope[inside].mean()))
    columns: Any = zip(*rows, strict=True) if rows else ([], [], np.empty((0, 2)), [], [])
    return Misfit(*(np.array(column) for column in columns))


def _px_per_rad(lens, angle: np.ndarray) -> np.ndarray:
    step = 1e-4
    rays = [
        np.stack([np.sin(a), np.zeros_like(a), np.cos(a)], axis=-1)
        for a in (angle.clip(step) - step, angle.clip(step))
    ]
    before, after = (lens.project(r)[0][:, 0] for r in rays)
    return np.maximum(np.abs(after - before) / step, 1.0)
