"""Pictures that were turned by half a turn: their principal point lies on the other side."""

from dataclasses import replace
from itertools import compress

import numpy as np

from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.lens_fit import GROUPS, FitProblem
from fisheye_undistort.fit.model_fitter import ModelFitter

_FEWEST = 4
"""Views among which two groups can be told apart."""
_MIN_GAIN = 1.1
"""Turning some must make the cost smaller by this factor, or they stay as they are."""
_ROUNDS = 3
"""A few views of no clear side are told apart once the others are right."""


def turned(view: TargetView, size: tuple[int, int]) -> TargetView:
    """Return what is seen in the picture turned by 180 degrees."""
    return replace(view, points_px=np.array(size) - 1.0 - view.points_px)


def turn_back(fitter: ModelFitter, start: Estimate) -> tuple[ModelFitter, Estimate, list[str]]:
    """Turn those views back that were turned, if there are any.

    Each view alone tells where it wants the principal point, with the rest of the lens as all
    together have it. Of two groups on both sides of the middle, the smaller one is turned (of two
    of one size, that without the first view).

    Returns
    -------
    fitter, estimate
        Of the turned views and what they give; the same as before if none was turned.
    names
        Of the views that were turned.
    """
    is_turned = np.zeros(len(fitter.views), bool)
    if len(fitter.views) < _FEWEST:
        return fitter, start, []
    for _ in range(_ROUNDS):
        side = _other_side(fitter, start)
        other = fitter.of(
            [
                turned(view, fitter.size) if turn else view
                for view, turn in zip(fitter.views, side, strict=True)
            ]
        )
        estimate = other.rough() if side.any() else start
        if _MIN_GAIN * estimate.cost > start.cost:
            break
        fitter, start, is_turned = other, estimate, is_turned ^ side
    return fitter, start, [view.name for view in compress(fitter.views, is_turned)]


def _other_side(fitter: ModelFitter, estimate: Estimate) -> np.ndarray:
    """Mark the views (V,) of the smaller group."""
    wanted = _centers(fitter, estimate) - (np.array(fitter.size) - 1) / 2
    axis = np.linalg.svd(wanted, full_matrices=False)[2][0]
    side = wanted @ axis > 0
    count = np.count_nonzero(side)
    if 2 * count > len(side) or (2 * count == len(side) and side[0]):
        side = ~side
    return side


def _centers(fitter: ModelFitter, estimate: Estimate) -> np.ndarray:
    """Principal point (V, 2) that each view alone asks for, px."""
    points_mm = fitter.target.points_mm
    free = ('principal point',)
    problem = FitProblem(fitter.views, points_mm, estimate.unknowns, free)
    normal = problem.normal_equations(problem.pack(estimate))
    changes = normal.each_alone()
    basis = GROUPS['principal point']
    return (estimate.unknowns + changes @ basis)[:, 2:4]
