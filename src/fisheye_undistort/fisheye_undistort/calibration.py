"""Calibrate a lens from views of a flat target."""

from dataclasses import dataclass
from itertools import compress

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.estimate import Estimate, TargetView, rms
from fisheye_undistort.model_fitter import ModelFitter
from fisheye_undistort.sheet_model import UNKNOWNS, lens_of, to_camera, warp_board
from fisheye_undistort.target import Target

_OUTLIER_RATIO = 4.0
"""A view whose rms is this many times the median does not show what the others show."""
_OUTLIER_WIDTHS = 1 / 1000
"""Nor is any view dropped whose rms is below this share of the picture's width."""


@dataclass(frozen=True)
class Calibration:
    """A calibrated lens, and what there is to believe in it.

    Attributes
    ----------
    lens
        The result.
    estimate
        Its poses, residuals and covariance, as `lens_fit.fit` returns them.
    views
        Those that were used, in the order of `estimate.poses`.
    dropped
        Name of each view that was not used, and why.
    target
        What was printed.
    """

    lens: FisheyeLens
    estimate: Estimate
    views: tuple[TargetView, ...]
    dropped: dict[str, str]
    target: Target

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all points from where the model puts them."""
        return rms(np.concatenate(self.estimate.residuals_px))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each of `UNKNOWNS`; 0 for what was not fitted."""
        return dict(zip(UNKNOWNS, np.sqrt(np.diag(self.estimate.covariance)), strict=True))

    @property
    def directions_rad(self) -> tuple[np.ndarray, np.ndarray]:
        """Angle from the axis and about it of the target's points, all views in one array."""
        points = warp_board(self.target.points_mm, self.estimate.board_warp_mm)
        x, y, z = np.concatenate(
            [
                to_camera(pose, points[view.ids])
                for pose, view in zip(self.estimate.poses, self.views, strict=True)
            ]
        ).T
        return np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)


def calibrate(
    views: list[TargetView], target: Target, size: tuple[int, int], *, correct_bias: bool = True
) -> Calibration:
    """Fit a Kannala-Brandt lens to views of a target.

    Parameters
    ----------
    views
        What was seen of the target.
    target
        What was printed.
    size
        Width and height of the pictures, px.
    correct_bias
        Whether to account for a circle's centre of mass not being where its centre is seen.

    Raises
    ------
    CalibrationError
        If there are no views, or none that fit a lens.
    """
    if not views:
        raise CalibrationError('there is no view of the target to calibrate from')
    try:
        with np.errstate(divide='raise', invalid='raise'):
            fitter, estimate, dropped = _fit_without_outliers(views, target, size, correct_bias)
        lens = lens_of(estimate.unknowns, size)
    except (FloatingPointError, np.linalg.LinAlgError, CalibrationError) as error:
        raise CalibrationError(
            f'no lens fits what was seen of the target ({error}); tilt it, and bring it nearer '
            'and to the edges of the picture'
        ) from error
    return Calibration(lens, estimate, tuple(fitter.views), dropped, target)


def _fit_without_outliers(
    views: list[TargetView], target: Target, size: tuple[int, int], correct_bias: bool
) -> tuple[ModelFitter, Estimate, dict[str, str]]:
    """Fit, leave out the views that do not fit, and fit again until all do."""
    fitter = ModelFitter(views, target, size, correct_bias)
    dropped: dict[str, str] = {}
    while True:
        sequence = fitter.fit_sequence()
        outliers = _outlying_views(sequence[-1], size)
        if not outliers.any():
            return fitter, fitter.choose(sequence), dropped
        rms = sequence[-1].rms_px[outliers]
        dropped |= {
            view.name: f'does not fit: rms {miss:.2f} px'
            for view, miss in zip(compress(fitter.views, outliers), rms, strict=True)
        }
        fitter = ModelFitter([*compress(fitter.views, ~outliers)], target, size, correct_bias)


def _outlying_views(estimate: Estimate, size: tuple[int, int]) -> np.ndarray:
    """Mark the views (V,) that the lens does not explain as it explains the others."""
    rms = estimate.rms_px
    return rms > max(_OUTLIER_RATIO * np.median(rms), _OUTLIER_WIDTHS * size[0])
