"""Estimates: a lens as good as known so far, and the views of a target that it is to explain."""

from dataclasses import dataclass, field

import numpy as np

from fisheye_undistort.fit.sheet_model import INTRINSICS, UNKNOWNS


@dataclass(frozen=True)
class TargetView:
    """One picture of the target.

    Attributes
    ----------
    name
        Of the picture.
    points_px
        (N, 2) float64, found in it.
    ids
        (N,) int, the points of the target that they are.
    """

    name: str
    points_px: np.ndarray
    ids: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """A lens and the sheets before it, as good as known so far.

    Attributes
    ----------
    unknowns
        (11,) in the order of `UNKNOWNS`.
    poses
        (V, 6) rotation vector and translation, target to camera, rad and mm.
    residuals_px
        One (N, 2) array for each view: found minus predicted.
    covariance
        (11, 11) of the unknowns; 0 for what was not fitted.
    cost
        The robust cost, about the sum of squared residuals, px^2.
    free
        Names of the `lens_fit.GROUPS` that were fitted.
    """

    unknowns: np.ndarray
    poses: np.ndarray
    residuals_px: tuple[np.ndarray, ...] = ()
    covariance: np.ndarray = field(default_factory=lambda: np.zeros((len(UNKNOWNS),) * 2))
    cost: float = np.inf
    free: tuple[str, ...] = ()

    @property
    def board_warp_mm(self) -> np.ndarray:
        """(3,) as `warp_board` takes it."""
        return self.unknowns[len(INTRINSICS) :]

    @property
    def noise_px(self) -> float:
        """Standard deviation of a coordinate of a point, from the robust cost."""
        equations = 2 * sum(map(len, self.residuals_px))
        unknowns = self.poses.size + np.count_nonzero(np.diag(self.covariance))
        return float(np.sqrt(self.cost / max(equations - unknowns, 1)))

    @property
    def rms_px(self) -> np.ndarray:
        """Root mean square distance of each view's points, (V,) px."""
        return np.array([rms(residuals) for residuals in self.residuals_px])


def rms(residuals_px: np.ndarray) -> float:
    """Root of the mean squared length of residuals (N, 2)."""
    return float(np.sqrt(np.mean(np.sum(residuals_px**2, axis=-1))))
