"""Calibrate a lens from views of a flat target."""

from dataclasses import dataclass
from functools import cached_property
from itertools import compress

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.angle_map import AngleMap
from fisheye_undistort.fit.cross_validation import Halves, cross_validate
from fisheye_undistort.fit.estimate import Estimate, TargetView, rms
from fisheye_undistort.fit.model_fitter import ModelFitter
from fisheye_undistort.fit.outliers import outlying_views, without_outlying_points
from fisheye_undistort.fit.sheet_model import UNKNOWNS, lens_of, to_camera, warp_board
from fisheye_undistort.fit.turned_views import turn_back
from fisheye_undistort.target.target import Target

_MAX_FOCAL_DEVIATION = 0.2
"""Share of the focal length; more uncertain than that, nothing is known of the lens."""
_MAX_FOCAL_WIDTHS = 5.0
"""Longer than that it is where the sheet shows neither perspective nor distortion."""


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
    outlying
        Points of used views that were left out, each with its view and how far it is off.
    turned
        Names of the views whose pictures were turned by 180 degrees.
    halves
        What the even and the odd views say apart; None of too few.
    """

    lens: FisheyeLens
    estimate: Estimate
    views: tuple[TargetView, ...]
    dropped: dict[str, str]
    target: Target
    outlying: tuple[str, ...] = ()
    turned: tuple[str, ...] = ()
    halves: Halves | None = None

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all points from where the model puts them."""
        return rms(np.concatenate(self.estimate.residuals_px))

    @property
    def covariance(self) -> np.ndarray:
        """Covariance (11, 11) of `UNKNOWNS`, enlarged until both halves agree."""
        excess = self.halves.excess if self.halves else 1.0
        return excess**2 * self.estimate.covariance

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each of `UNKNOWNS`."""
        return dict(zip(UNKNOWNS, np.sqrt(np.diag(self.covariance)).tolist(), strict=True))

    @cached_property
    def angles(self) -> AngleMap:
        """Rays of the lens over its picture."""
        return AngleMap.of(self.lens)

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
    views: list[TargetView],
    target: Target,
    size: tuple[int, int],
    *,
    lit: np.ndarray | None = None,
    correct_bias: bool = True,
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
    lit
        (30, 40) bool of `angle_map.lit_part`: where both halves of the views must agree; None:
        everywhere.
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
            return _calibrate(ModelFitter(views, target, size, correct_bias=correct_bias), lit)
    except (FloatingPointError, np.linalg.LinAlgError, CalibrationError) as error:
        raise CalibrationError(
            f'no lens fits what was seen of the target ({error}); tilt it, and bring it nearer '
            'and to the edges of the picture'
        ) from error


def _calibrate(fitter: ModelFitter, lit: np.ndarray | None) -> Calibration:
    fitter, rough, turned = turn_back(fitter, fitter.rough())
    fitter, rough, dropped = _without_outlying_views(fitter, rough)
    estimate = fitter.fine(rough)
    views, outlying = without_outlying_points(
        fitter.views, estimate, fitter.target, fitter.size[0]
    )
    if outlying:
        fitter = fitter.of(views)
        estimate = fitter.fine(estimate)
    focal_px, deviation_px = estimate.unknowns[0], float(np.sqrt(estimate.covariance[0, 0]))
    longest_px = _MAX_FOCAL_WIDTHS * fitter.size[0]
    if deviation_px > _MAX_FOCAL_DEVIATION * focal_px or focal_px > longest_px:
        raise CalibrationError(f'the focal length is {focal_px:.0f} +- {deviation_px:.0f} px')
    lens = lens_of(estimate.unknowns, fitter.size)
    halves = cross_validate(fitter, estimate, lit)
    return Calibration(
        lens,
        estimate,
        tuple(fitter.views),
        dropped,
        fitter.target,
        tuple(outlying),
        tuple(turned),
        halves,
    )


def _without_outlying_views(
    fitter: ModelFitter, rough: Estimate
) -> tuple[ModelFitter, Estimate, dict[str, str]]:
    """Leave out the views that do not fit, and fit again until all do."""
    dropped: dict[str, str] = {}
    while (outliers := outlying_views(rough, fitter.size[0])).any():
        dropped |= {
            view.name: f'does not fit: rms {off:.2f} px'
            for view, off in zip(
                compress(fitter.views, outliers), rough.rms_px[outliers], strict=True
            )
        }
        fitter = fitter.part(np.flatnonzero(~outliers))
        rough = fitter.rough()
    return fitter, rough, dropped
