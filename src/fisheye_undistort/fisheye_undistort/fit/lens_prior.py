"""What is known of a lens and a sheet before anything is seen of them.

Four coefficients bend freely where there are no points. Real lenses do not: their curves lie about
the classical ones (equidistant, equisolid, stereographic, orthographic and between) and leave them
smoothly. That is a Gaussian prior of the coefficients; it decides nothing where there are points,
and tells beyond them what may be and by how much it may be wrong.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np

from fisheye_undistort.fit.sheet_model import EVEN_POWERS, INTRINSICS, UNKNOWNS

_ANGLES_RAD = np.radians(np.arange(1.0, 113.0))
"""Where the curves are compared: as far as the widest lenses see."""
_SINES = np.arange(0.2, 1.0, 0.1)
_TANGENTS = np.arange(0.2, 0.6, 0.1)
"""Lenses with sin(a t) / a and tan(a t) / a: a = 1/2 is equisolid and stereographic."""
_BEND, _BEND_RAD = 0.06, 0.7
"""How far a curve leaves those at 90 degrees, as a share, and over which angle it may turn."""

_ASPECT = 0.01
_CENTER_WIDTHS = 0.03
_WARP = 0.01
"""Depth of a board's warp, in shares of half its longer side."""


@dataclass(frozen=True)
class Prior:
    """A Gaussian prior of the unknowns, as residuals that are added to those of the points.

    Attributes
    ----------
    mean
        (11,) in the order of `UNKNOWNS`.
    root
        (K, 11): the residuals are `root @ (unknowns - mean)`, px.
    """

    mean: np.ndarray
    root: np.ndarray

    @classmethod
    def none(cls) -> 'Prior':
        """Nothing is known."""
        return cls(np.zeros(len(UNKNOWNS)), np.zeros((0, len(UNKNOWNS))))

    def residuals(self, unknowns: np.ndarray) -> np.ndarray:
        """Return how far unknowns (11,) are from the mean, (K,) px."""
        return self.root @ (unknowns - self.mean)


def usual_lens(
    unknowns: np.ndarray, size: tuple[int, int], points_mm: np.ndarray, noise_px: float
) -> Prior:
    """Return the prior of any fisheye lens before a sheet that is nearly flat.

    Parameters
    ----------
    unknowns
        (11,), of which the focal length sets the scale.
    size
        Width and height of the pictures, px.
    points_mm
        (M, 3) of the target.
    noise_px
        Standard deviation of a coordinate of a point: what one deviation of the prior costs.
    """
    coefficients, spread = usual_distortion()
    mean = np.zeros(len(UNKNOWNS))
    mean[2:4] = (size[0] - 1) / 2, (size[1] - 1) / 2
    mean[4 : len(INTRINSICS)] = coefficients
    root = np.zeros((10, len(UNKNOWNS)))
    root[0, :2] = np.array([-1, 1]) / (_ASPECT * unknowns[0])
    root[[1, 2], [2, 3]] = 1 / (_CENTER_WIDTHS * size[0])
    root[3:7, 4 : len(INTRINSICS)] = np.linalg.inv(np.linalg.cholesky(spread))
    root[7:, len(INTRINSICS) :] = np.eye(3) / (_WARP * np.abs(points_mm).max())
    return Prior(mean, noise_px * root)


def assumed_deviations(
    unknowns: np.ndarray, size: tuple[int, int], points_mm: np.ndarray
) -> np.ndarray:
    """Return the deviations (11,) that are known before anything is seen; inf: none."""
    root = usual_lens(unknowns, size, points_mm, 1.0).root
    deviations = np.full(len(UNKNOWNS), np.inf)
    # The first row ties the focal lengths to each other, and alone would fix neither.
    deviations[1] = _ASPECT * unknowns[0]
    deviations[2:] = np.sqrt(np.diag(np.linalg.inv(root[1:, 2:].T @ root[1:, 2:])))
    return deviations


@cache
def usual_distortion() -> tuple[np.ndarray, np.ndarray]:
    """Mean (4,) and covariance (4, 4) of the coefficients of fisheye lenses."""
    angles = _ANGLES_RAD
    curves = [np.sin(a * angles) / (a * angles) - 1 for a in _SINES]
    curves += [np.tan(a * angles) / (a * angles) - 1 for a in _TANGENTS]
    bend = _BEND * (2 * angles / np.pi) ** 2
    turn = (angles[:, None] - angles) / _BEND_RAD
    spread = np.cov(np.transpose(curves)) + np.outer(bend, bend) * np.exp(-(turn**2) / 2)
    to_coefficients = np.linalg.pinv(angles[:, None] ** EVEN_POWERS)
    mean = to_coefficients @ np.mean(curves, axis=0)
    return mean, to_coefficients @ spread @ to_coefficients.T
