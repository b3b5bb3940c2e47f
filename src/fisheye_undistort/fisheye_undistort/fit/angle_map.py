"""How far off a lens may be over its picture, as angles."""

from dataclasses import dataclass

import cv2
import numpy as np

from fisheye_geometry.attitude import closest_rotation
from fisheye_geometry.lens import FisheyeLens, Lens
from fisheye_undistort.fit.sheet_model import INTRINSICS, intrinsics_of, project

_COLUMNS, _ROWS = 40, 30
_LIT_LEVEL = 16
"""An unlit sensor stays below it, but for a few noisy pixels; grey levels."""
_BLOCK = 9
"""Part of the picture, a share of its width to one, over which noise is averaged away."""
_ROUNDS = 8
_SIDE = 1 / 3
"""The middle third of the picture is neither left nor right, nor top nor bottom."""


def picture_grid(size: tuple[int, int]) -> np.ndarray:
    """Pixels (30, 40, 2) all over a picture of (width, height), its corners among them."""
    x, y = (np.linspace(0, side - 1, n) for side, n in zip(size, (_COLUMNS, _ROWS), strict=True))
    return np.stack(np.meshgrid(x, y), axis=-1)


def lit_part(brightest: np.ndarray) -> np.ndarray:
    """Mark the points (30, 40) of the grid that light has reached.

    Parameters
    ----------
    brightest
        (height, width) uint8, the brightest that each pixel was.
    """
    side = max(1, brightest.shape[1] // _BLOCK // 10)
    smooth = cv2.blur(brightest, (side, side), borderType=cv2.BORDER_REPLICATE)
    x, y = np.moveaxis(picture_grid(brightest.shape[::-1]).round().astype(int), -1, 0)
    return smooth[y, x] > _LIT_LEVEL


def place_name(x: float, y: float, shape: tuple[int, ...]) -> str:
    """Name a part of a picture of (height, width)."""
    across, down = 2 * x / (shape[1] - 1) - 1, 2 * y / (shape[0] - 1) - 1
    names = [
        'top' if down < -_SIDE else 'bottom' if down > _SIDE else '',
        'left' if across < -_SIDE else 'right' if across > _SIDE else '',
    ]
    part = ' '.join(filter(None, names))
    return f'{part} corner' if all(names) else f'{part} edge' if part else 'middle'


@dataclass(frozen=True)
class AngleMap:
    """Rays of a lens over its picture, and how they change with its intrinsics.

    Attributes
    ----------
    pixels
        (30, 40, 2) of `picture_grid`.
    rays
        (30, 40, 3) unit vectors.
    seen
        (30, 40) bool, where the lens has a ray.
    slopes
        (30, 40, 3, 8) derivatives of the rays by the intrinsics, rad by the unit of each.
    """

    pixels: np.ndarray
    rays: np.ndarray
    seen: np.ndarray
    slopes: np.ndarray

    @classmethod
    def of(cls, lens: FisheyeLens) -> 'AngleMap':
        """Return the map of a lens."""
        pixels = picture_grid((lens.width, lens.height))
        rays, seen = lens.unproject(pixels)
        _, by_intrinsics, by_ray = project(intrinsics_of(lens), rays.reshape(-1, 3))
        # Where the lens ends its radius stands still: nothing is known of the angle there.
        slopes = -np.linalg.pinv(by_ray, rcond=1e-9) @ by_intrinsics
        return cls(pixels, rays, seen, slopes.reshape(*seen.shape, 3, len(INTRINSICS)))

    @property
    def angle_rad(self) -> np.ndarray:
        """Angles (30, 40) from the axis; NaN where nothing is seen."""
        x, y, z = np.moveaxis(self.rays, -1, 0)
        return np.where(self.seen, np.arctan2(np.hypot(x, y), z), np.nan)

    def deviation_rad(self, covariance: np.ndarray) -> np.ndarray:
        """Standard deviation (30, 40) of the rays, all directions together; NaN where not seen.

        Parameters
        ----------
        covariance
            (8, 8) or more, of the unknowns.
        """
        count = len(INTRINSICS)
        variance = np.einsum(
            '...ij,jk,...ik->...', self.slopes, covariance[:count, :count], self.slopes
        )
        return np.where(self.seen, np.sqrt(variance.clip(0)), np.nan)


def difference_rad(
    one: Lens, other: Lens, pixels: np.ndarray, *, turned: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return the angles between the rays of two lenses at the same pixels.

    Parameters
    ----------
    one, other
        Lenses of one size.
    pixels
        (..., 2) px.
    turned
        Whether the second lens may be turned to fit the first best: a rotation of the camera as a
        whole is no error of its lens.

    Returns
    -------
    angles : ndarray
        (...) rad; NaN where either sees nothing.
    rotation : ndarray
        (3, 3) rays of the second lens to rays of the first.
    """
    (first, seen_first), (second, seen_second) = (lens.unproject(pixels) for lens in (one, other))
    seen = seen_first & seen_second
    rotation, weight = np.eye(3), np.ones(seen.shape)
    apart = np.linalg.norm(first - second, axis=-1)
    for _ in range(_ROUNDS if turned and seen.any() else 0):
        rotation = closest_rotation(first[seen], second[seen], weight[seen])
        apart = np.linalg.norm(first - second @ rotation.T, axis=-1)
        # Where the lenses differ most says least about how the cameras are turned.
        weight = 1 / (apart + np.median(apart[seen]) + 1e-12)
    return np.where(seen, 2 * np.arcsin((apart / 2).clip(0, 1)), np.nan), rotation
