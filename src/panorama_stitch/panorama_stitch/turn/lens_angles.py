"""How far off the angles of a lens may be, all over its picture."""

from dataclasses import dataclass

import cv2
import numpy as np

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import project

_COLUMNS, _ROWS = 33, 25
_DARK_LEVEL = 16
"""Below it the sensor is not lit, grey levels."""
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
        halves of the sightings disagree by where that is more.
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
        x, y = (
            np.linspace(0, side - 1, n)
            for side, n in ((lens.width, _COLUMNS), (lens.height, _ROWS))
        )
        pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        rays, seen = lens.unproject(pixels)
        light = cv2.blur(brightest, (5, 5))[tuple(np.rint(pixels[:, ::-1]).astype(int).T)]
        seen &= light > _DARK_LEVEL
        pixels, rays = pixels[seen], rays[seen]
        unknowns = np.array([*lens.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], *lens.distortion])
        _, by_intrinsics, by_ray = project(unknowns, rays)
        # What moves a pixel is made up for by the ray that moves it back.
        slopes = -np.linalg.pinv(by_ray, rcond=1e-9) @ by_intrinsics
        variance = np.einsum('nij,jk,nik->n', slopes, covariance, slopes)
        one, other = (half.unproject(pixels)[0] for half in halves)
        apart = np.linalg.norm(one - other, axis=1) / 2
        x, y, z = rays.T
        return cls(
            lens,
            np.arctan2(np.hypot(x, y), z),
            np.arctan2(y, x),
            np.maximum(np.sqrt(variance.clip(0)), apart),
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
        sides = (
            'right',
            'lower right',
            'bottom',
            'lower left',
            'left',
            'upper left',
            'top',
            'upper right',
        )
        at = sides[round(self.azimuths[worst] / (np.pi / 4)) % len(sides)]
        return f'{np.degrees(self.angles[worst]):.0f} degrees off the axis to the {at}'
