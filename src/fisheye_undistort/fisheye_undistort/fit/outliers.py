"""Views and points that do not show what the others show."""

from dataclasses import replace

import numpy as np

from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.target.target import Target

_VIEW_RATIO = 4.0
"""A view whose residuals are this many times the median does not show what the others show."""
_POINT_DEVIATIONS = 7.0
"""A point this many standard deviations from where the lens has it was found wrongly."""
_LEAST_WIDTHS = 1 / 1000
"""Nothing is left out that is off by less than this share of the picture's width."""
_FEWEST = 4
"""Points that a view must keep."""
_RAYLEIGH_MEDIAN = 1.1774
"""Median length of a vector whose coordinates have a deviation of 1."""


def outlying_views(estimate: Estimate, width: int) -> np.ndarray:
    """Mark the views (V,) that the lens does not explain as it explains the others."""
    # Most of a view's points: a few wrong ones are left out without the view.
    usual = np.array(
        [np.median(np.linalg.norm(residuals, axis=-1)) for residuals in estimate.residuals_px]
    )
    return usual > max(_VIEW_RATIO * np.median(usual), _LEAST_WIDTHS * width)


def without_outlying_points(
    views: list[TargetView], estimate: Estimate, target: Target, width: int
) -> tuple[list[TargetView], list[str]]:
    """Leave out the points that were found where they are not.

    Returns
    -------
    views : list of TargetView
        Those without such points are the same objects.
    told : list of str
        Which points of which views, and how far off.
    """
    lengths = [np.linalg.norm(residuals, axis=-1) for residuals in estimate.residuals_px]
    usual = float(np.median(np.concatenate(lengths))) / _RAYLEIGH_MEDIAN
    limit = max(_POINT_DEVIATIONS * usual, _LEAST_WIDTHS * width)
    kept, told = [], []
    for view, length in zip(views, lengths, strict=True):
        far = length > limit
        if not far.any() or np.count_nonzero(~far) < _FEWEST:
            kept.append(view)
            continue
        for point, off_px in zip(view.ids[far], length[far], strict=True):
            told.append(f'{view.name}: {target.name_of(point)}, {off_px:.1f} px off')
        kept.append(replace(view, points_px=view.points_px[~far], ids=view.ids[~far]))
    return kept, told
