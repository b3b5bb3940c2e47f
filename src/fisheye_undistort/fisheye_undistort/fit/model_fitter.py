"""From a first guess to the lens that explains the views of a target best."""

import numpy as np

from fisheye_undistort.fit.circle_bias import center_bias
from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.first_guess import first_guess
from fisheye_undistort.fit.lens_fit import GROUPS, fit
from fisheye_undistort.fit.lens_prior import usual_lens
from fisheye_undistort.target.target import Target

_STAGES = (
    ('focal length',),
    ('focal length', 'k1', 'principal point'),
    ('focal length', 'k1', 'principal point', 'k2', 'aspect ratio'),
    tuple(GROUPS),
)
"""What is fitted, from what every picture tells to what only many can."""

_ROUGH = 1e-3
"""Relative change of the cost at which a fit is good enough to start the next from."""
_FINE = 1e-8
_BIAS_ROUNDS = 6
_BIAS_SETTLED_PX = 0.002
_NOISE_ROUNDS = 2
_LEAST_NOISE_PX = 1e-6
_FIRST_NOISE_PX = 0.5


class ModelFitter:
    """Fits a lens to views, first roughly, then to the last digit.

    Attributes
    ----------
    views : list of TargetView
        What it explains.
    target : Target
        What was printed.
    size : tuple
        Width and height of the pictures, px.
    """

    def __init__(
        self,
        views: list[TargetView],
        target: Target,
        size: tuple[int, int],
        *,
        correct_bias: bool = True,
    ):
        self.views, self.target, self.size = views, target, size
        self._correct_bias = correct_bias and target.has_circles

    def part(self, some: np.ndarray) -> 'ModelFitter':
        """Return a fitter of the views with these indices."""
        return self.of([self.views[i] for i in some])

    def of(self, views: list[TargetView]) -> 'ModelFitter':
        """Return a fitter of other views of the same target."""
        return ModelFitter(views, self.target, self.size, correct_bias=self._correct_bias)

    def rough(self) -> Estimate:
        """Fit ever more, each stage from where the last one ended."""
        estimate = first_guess(self.views, self.target.points_mm, self.size)
        for free in _STAGES:
            estimate = self._fit(estimate, free, _FIRST_NOISE_PX, None, _ROUGH)
        return estimate

    def fine(self, start: Estimate) -> Estimate:
        """Fit all, predict by how much the circles' centres of mass are off, and fit again."""
        estimate, bias = start, self.bias(start, self.views)
        for _ in range(_NOISE_ROUNDS):
            estimate = self._fit(estimate, _STAGES[-1], estimate.noise_px, bias, _FINE)
        for _ in range(_BIAS_ROUNDS if self._correct_bias else 0):
            before, bias = bias, self.bias(estimate, self.views)
            if _change(before, bias) < _BIAS_SETTLED_PX:
                break
            estimate = self._fit(estimate, _STAGES[-1], estimate.noise_px, bias, _FINE)
        return estimate

    def bias(self, estimate: Estimate, views: list[TargetView]) -> list[np.ndarray] | None:
        """Return what `center_bias` predicts for the circles of views; None for corners."""
        return center_bias(estimate, views, self.target) if self._correct_bias else None

    def _fit(self, start: Estimate, free, noise_px, bias, tolerance) -> Estimate:
        points_mm = self.target.points_mm
        noise_px = max(noise_px, _LEAST_NOISE_PX)
        prior = usual_lens(start.unknowns, self.size, points_mm, noise_px)
        return fit(self.views, points_mm, start, start.unknowns, free, bias, prior, tolerance)


def _change(before, after) -> float:
    return float(np.abs(np.concatenate(before) - np.concatenate(after)).max())
