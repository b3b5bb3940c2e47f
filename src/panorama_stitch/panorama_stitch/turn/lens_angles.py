"""How far off the angles of a lens may be, all over its picture."""

from dataclasses import dataclass

import numpy as np

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.angle_map import AngleMap, lit_part
from fisheye_undistort.report.misfit import DIRECTIONS, sector_of

_COMMON_PX = 0.1
"""By which every sighting of a landmark may be off alike: neither their scatter nor two halves of
them show it."""
_MIDDLE = 0.5
"""Of the angle at the edge: what is within is not near any edge."""


@dataclass(frozen=True)
class LensAngles:
    """A lens, and how far off its angles may be.

    Attributes
    ----------
    lens
        It.
    angles
        (N,) from the axis, at places that light reaches, rad.
    azimuths
        (N,) about the axis, 0 to the right, clockwise, rad.
    deviations
        (N,) standard deviation of the ray there, rad: from the covariance, or half of what two
        halves of the sightings disagree by where that is more, and what all have in common.
    """

    lens: FisheyeLens
    angles: np.ndarray
    azimuths: np.ndarray
    deviations: np.ndarray

    @classmethod
    def of(
        cls,
        lens: FisheyeLens,
        covariance: np.ndarray,
        halves: tuple[FisheyeLens, ...],
        brightest: np.ndarray,
    ) -> 'LensAngles':
        """Look at a lens all over its picture.

        Parameters
        ----------
        lens
            Which.
        covariance
            (8, 8) of `INTRINSICS`.
        halves
            The same lens from either half of the sightings.
        brightest
            (height, width) uint8, the brightest that each pixel was.
        """
        angles = AngleMap.of(lens)
        seen = angles.seen & lit_part(brightest)
        one, other = (half.unproject(angles.pixels)[0] for half in halves)
        apart = np.linalg.norm(one - other, axis=-1) / 2
        x, y, _ = angles.rays[seen].T
        return cls(
            lens,
            angles.angle_rad[seen],
            np.arctan2(y, x),
            with_common(np.maximum(angles.deviation_rad(covariance), apart)[seen], lens),
        )

    @property
    def edge_rad(self) -> float:
        """Largest angle that light reaches."""
        return float(self.angles.max())

    @property
    def worst_deg(self) -> float:
        """Largest deviation."""
        return float(np.degrees(self.deviations.max()))

    @property
    def worst_place(self) -> str:
        """Where that is."""
        worst = int(np.argmax(self.deviations))
        if self.angles[worst] < _MIDDLE * self.edge_rad:
            return 'in the middle'
        direction = DIRECTIONS[sector_of(self.azimuths[worst])]
        return f'{np.degrees(self.angles[worst]):.0f} degrees off the axis {direction}'


def with_common(deviation_rad: np.ndarray | float, lens: FisheyeLens) -> np.ndarray:
    """Add to a deviation, rad, what sightings through a lens have in common."""
    return np.hypot(deviation_rad, _COMMON_PX / lens.focal_x_px)
