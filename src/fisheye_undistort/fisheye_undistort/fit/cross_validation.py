"""Two lenses from two halves of the views: what they disagree in, nobody knows."""

from dataclasses import dataclass

import numpy as np

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.angle_map import AngleMap, difference_rad
from fisheye_undistort.fit.estimate import Estimate, rms
from fisheye_undistort.fit.lens_fit import fit
from fisheye_undistort.fit.model_fitter import ModelFitter
from fisheye_undistort.fit.sheet_model import lens_of

_FEWEST = 4
"""Views that can be halved."""


@dataclass(frozen=True)
class Halves:
    """Lenses fitted to every other view each.

    Attributes
    ----------
    lenses
        Of the even and of the odd views.
    held_out_px
        Root mean square distance of the points of each half's views from where the other half's
        lens has them, the poses fitted.
    excess
        How many times the difference is what the deviations of both promise; 1 at least.
    """

    lenses: tuple[FisheyeLens, FisheyeLens]
    held_out_px: float
    excess: float

    def difference_rad(self, pixels: np.ndarray) -> np.ndarray:
        """Angles (...) between both lenses' rays at pixels (..., 2), a rotation taken out."""
        return difference_rad(self.lenses[0], self.lenses[1], pixels, turned=True)[0]


def cross_validate(fitter: ModelFitter, whole: Estimate, lit: np.ndarray | None) -> Halves | None:
    """Fit the even and the odd views apart; None where there are too few.

    Parameters
    ----------
    fitter
        Of all views.
    whole
        What it found.
    lit
        (30, 40) bool, the part of the picture that counts; None: all of it.
    """
    count = len(fitter.views)
    if count < _FEWEST:
        return None
    parts = [np.arange(start, count, 2) for start in (0, 1)]
    estimates = [fitter.part(some).fine(_of(whole, some)) for some in parts]
    even, odd = (lens_of(estimate.unknowns, fitter.size) for estimate in estimates)
    errors = [
        _held_out(fitter, whole, some, estimate)
        for some, estimate in zip(parts, reversed(estimates), strict=True)
    ]
    angles = AngleMap.of(lens_of(whole.unknowns, fitter.size))
    apart, _ = difference_rad(even, odd, angles.pixels, turned=False)
    promised = angles.deviation_rad(estimates[0].covariance + estimates[1].covariance)
    use = np.isfinite(apart + promised) & (promised > 0)
    if lit is not None:
        use &= lit
    ratio = float(np.sqrt(np.mean((apart[use] / promised[use]) ** 2))) if use.any() else 1.0
    return Halves((even, odd), rms(np.concatenate(errors)), max(1.0, ratio))


def _of(whole: Estimate, some: np.ndarray) -> Estimate:
    """Return an estimate of some of its views."""
    residuals = tuple(whole.residuals_px[i] for i in some)
    cost = whole.cost * sum(map(len, residuals)) / sum(map(len, whole.residuals_px))
    return Estimate(
        whole.unknowns, whole.poses[some], residuals, whole.covariance, cost, whole.free
    )


def _held_out(fitter, whole, some, estimate) -> np.ndarray:
    """Residuals (N, 2) of some views before a lens that was fitted to others."""
    start = Estimate(estimate.unknowns, whole.poses[some])
    views = [fitter.views[i] for i in some]
    bias = fitter.bias(start, views)
    points_mm = fitter.target.points_mm
    fitted = fit(views, points_mm, start, estimate.unknowns, (), bias)
    return np.concatenate(fitted.residuals_px)
