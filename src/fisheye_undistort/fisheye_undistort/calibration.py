"""Calibrate a lens from views of a flat target."""

from dataclasses import dataclass
from itertools import compress
from math import inf

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.circle_bias import center_bias
from fisheye_undistort.first_guess import first_guess
from fisheye_undistort.lens_fit import GROUPS, Estimate, TargetView, fit
from fisheye_undistort.sheet_model import UNKNOWNS, lens_of, to_camera, warp_board
from fisheye_undistort.target import Target

_ORDER = (
    'focal length',
    'k1',
    'principal point',
    'k2',
    'aspect ratio',
    'k3',
    'k4',
    'board warp',
)
MODELS = tuple(_ORDER[:count] for count in range(1, len(_ORDER) + 1))
"""What is fitted, from what every picture tells to what only many can."""

_EQUATIONS_PER_UNKNOWN = 3
"""Equations left after the poses, for each free unknown: nine points hold four of them."""
_ROUGH = 1e-3
"""Relative change of the cost at which a fit is good enough to start the next from."""
_BIAS_ROUNDS = 6
_BIAS_SETTLED_PX = 0.002
_OUTLIER_RATIO = 4.0
"""A view whose rms is this many times the median does not show what the others show."""
_OUTLIER_WIDTHS = 1 / 1000
"""Nor is any view dropped whose rms is below this share of the picture's width."""
_LEAST_COST_PX2 = 1e-8


@dataclass(frozen=True)
class Calibration:
    """A calibrated lens, and what there is to believe in it.

    Attributes
    ----------
    lens
        The result.
    estimate
        Its poses, residuals and covariance, as `lens_fit` gives them.
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
        squares = np.concatenate([np.sum(r**2, axis=-1) for r in self.estimate.residuals_px])
        return float(np.sqrt(squares.mean()))

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
) -> tuple['_Fitter', Estimate, dict[str, str]]:
    """Fit, leave out the views that do not fit, and fit again until all do."""
    fitter = _Fitter(views, target, size, correct_bias)
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
        fitter = _Fitter([*compress(fitter.views, ~outliers)], target, size, correct_bias)


class _Fitter:
    """Fits ever richer models to the same views."""

    def __init__(self, views, target, size, correct_bias):
        self.views = views
        self._target = target
        self._correct_bias = correct_bias and target.has_circles
        self._start = first_guess(views, target.points_mm, size)
        self._equations = 2 * sum(len(view.ids) for view in views)
        affordable = (self._equations - 6 * len(views)) / _EQUATIONS_PER_UNKNOWN
        self._models = [free for free in MODELS if _unknowns(free) <= affordable] or MODELS[:1]

    def _fit(self, estimate: Estimate, free, bias, **how) -> Estimate:
        return fit(
            self.views, self._target.points_mm, estimate, self._start.unknowns, free, bias, **how
        )

    def fit_sequence(self) -> list[Estimate]:
        """Fit each model roughly, the next from where the last one ended."""
        sequence = [self._start]
        for free in self._models:
            sequence.append(self._fit(sequence[-1], free, None, tolerance=_ROUGH))
        return sequence[1:]

    def choose(self, sequence: list[Estimate]) -> Estimate:
        """Fit the richest model, then poorer ones for as long as they explain the data better.

        The Bayesian information criterion asks of each intrinsic that it lowers the cost by more
        than chance would (Schwarz 1978, doi 10.1214/aos/1176344136).
        """
        best, lowest, bias = sequence[-1], inf, None
        for start in reversed(sequence):
            estimate, bias = self._without_bias(start, bias)
            variance = max(estimate.cost, _LEAST_COST_PX2) / self._equations
            criterion = self._equations * np.log(variance)
            criterion += _unknowns(estimate.free) * np.log(self._equations)
            if criterion > lowest:
                break
            best, lowest = estimate, criterion
        return best

    def _without_bias(self, start: Estimate, bias) -> tuple[Estimate, list | None]:
        """Fit, predict by how much the circles' centres of mass are off, and fit again."""
        estimate = self._fit(start, start.free, bias)
        for _ in range(_BIAS_ROUNDS if self._correct_bias else 0):
            before, bias = bias, center_bias(estimate, self.views, self._target)
            if before and _change(before, bias) < _BIAS_SETTLED_PX:
                break
            estimate = self._fit(estimate, start.free, bias)
        return estimate, bias


def _unknowns(free: tuple[str, ...]) -> int:
    return sum(len(GROUPS[name]) for name in free)


def _change(before, after) -> float:
    return float(np.abs(np.concatenate(before) - np.concatenate(after)).max())


def _outlying_views(estimate: Estimate, size: tuple[int, int]) -> np.ndarray:
    """Mark the views (V,) that the lens does not explain as it explains the others."""
    rms = estimate.rms_px
    return rms > max(_OUTLIER_RATIO * np.median(rms), _OUTLIER_WIDTHS * size[0])
