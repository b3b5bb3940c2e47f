"""Lens models from poor to rich, and which of them the views of a target bear out."""

from math import inf

import numpy as np

from fisheye_undistort.circle_bias import center_bias
from fisheye_undistort.estimate import Estimate
from fisheye_undistort.first_guess import first_guess
from fisheye_undistort.lens_fit import GROUPS, fit

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
_LEAST_COST_PX2 = 1e-8


class ModelFitter:
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
