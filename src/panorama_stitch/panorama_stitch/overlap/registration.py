"""Registration of two views: offsets are proposed, verified on their structure, and refined."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from math import radians
from operator import itemgetter

import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.alignment import align, overlap_score
from panorama_stitch.overlap.correlation import ScoreMap, correlate
from panorama_stitch.overlap.overlap_settings import OverlapSettings
from panorama_stitch.overlap.particles import facing_halves
from panorama_stitch.overlap.pose import Pose
from panorama_stitch.overlap.structure import FacingPair, face

_SEARCH_PX_PER_DEG, _FINE_PX_PER_DEG = 2.0, 4.0
_APART_DEG = 3.0
"""Offsets nearer to each other are the same answer."""
_CANDIDATES = 8
_MOST_VERIFIED = 3
_CLOSE = 0.15
"""An offset whose score is this much below the best one may still be the right one."""
_CLEARLY = 0.03
"""A difference in fit that is not by chance."""
_AS_GOOD = 0.002
"""A difference in fit that the noise of a JPEG makes."""
_DISTINCT_RATIO, _DISTINCT_MARGIN = 1.4, 0.1
"""Where the scene is distinct, any other offset leaves this many times more unexplained, and its
fit is this much lower; less can come from noise, or from the edges of the pictures."""


@dataclass(frozen=True)
class Registration:
    """Where the right half lies in the left one, if anywhere.

    Attributes
    ----------
    pose
        px of the halves.
    fit
        Correlation of the structure of the overlap, less what chance may give; 0 to 1.
    rival_fit, rival_x_px
        The fit of the best other offset, and where that is.
    """

    pose: Pose
    fit: float = 0.0
    rival_fit: float = 0.0
    rival_x_px: float = 0.0

    @property
    def distinct(self) -> float:
        """0 to 1: how far any other offset is from fitting as well."""
        less_unexplained = (1 - self.rival_fit) / max(1 - self.fit, 1e-6)
        by_ratio = (less_unexplained - 1) / (_DISTINCT_RATIO - 1)
        by_margin = (self.fit - self.rival_fit) / _DISTINCT_MARGIN
        return min(max(min(by_ratio, by_margin), 0.0), 1.0)

    @property
    def confidence(self) -> float:
        """0 to 1: the fit, lowered where another offset fits nearly as well."""
        return self.fit * self.distinct


def register(
    left: np.ndarray,
    right: np.ndarray,
    surface_left: Surface,
    surface_right: Surface,
    settings: OverlapSettings,
    x_px: tuple[float, float],
) -> Registration:
    """Find where the facing halves of two grey pictures overlap.

    Parameters
    ----------
    left, right
        (height, width) uint8, 0 where nothing is seen.
    surface_left, surface_right
        What they show.
    settings
        How far to look, for what confidence, and whether the right camera may be turned.
    x_px
        Smallest and largest offset of the right half in the left one.

    Returns
    -------
    Registration
        Its pose and rival are in px of the right half in the left half.
    """
    left, right = facing_halves(left, right)
    level_y_px = surface_left.center_y_px - surface_right.center_y_px
    facing = face(left, right, surface_right, level_y_px, _SEARCH_PX_PER_DEG)
    tilt = settings.correct_tilt and surface_right.yaw_is_column_shift
    landscape = _explore(facing, settings, x_px)
    if landscape is None:
        return Registration(Pose(0.0, 0.0))
    offsets = landscape.peaks(_CANDIDATES, round(_APART_DEG * facing.px_per_deg))
    best = _verify(facing, landscape, offsets, tilt)
    pose = best.pose.scaled(facing.step)
    if best.confidence >= settings.min_confidence:
        pose = _refine(left, right, surface_right, level_y_px, pose, tilt)
    return replace(best, pose=pose, rival_x_px=best.rival_x_px * facing.step)


def fit_at(
    left: np.ndarray,
    right: np.ndarray,
    surface_left: Surface,
    surface_right: Surface,
    offset_x_px: float,
) -> float:
    """Score how well the right one of two grey images fits at an offset, 0 to 1."""
    left, right = facing_halves(left, right)
    level_y_px = surface_left.center_y_px - surface_right.center_y_px
    facing = face(left, right, surface_right, level_y_px, _SEARCH_PX_PER_DEG)
    half_start = surface_left.width - left.shape[1]
    return overlap_score(facing, Pose(offset_x_px - half_start, 0.0).scaled(1 / facing.step))


def _refine(left, right, surface_right, level_y_px, pose, tilt) -> Pose:
    """Align once more at full resolution, with no more of the halves than overlaps."""
    margin = round(_APART_DEG * surface_right.focal_px * radians(1))
    start = max(0, round(pose.x_px) - margin)
    left, right = left[:, start:], right[:, : left.shape[1] - round(pose.x_px) + margin]
    facing = face(left, right, surface_right, level_y_px, _FINE_PX_PER_DEG)
    begin = replace(pose, x_px=pose.x_px - start).scaled(1 / facing.step)
    pose = _level_if_as_good(facing, align(facing, begin, tilt, fine=True)).scaled(facing.step)
    return replace(pose, x_px=pose.x_px + start)


def _level_if_as_good(facing: FacingPair, pose: Pose) -> Pose:
    """Leave out a tilt that closes the seam no better than none: noise alone would make one."""
    start = replace(pose, y_px=facing.level_y_px, pitch_rad=0.0, roll_rad=0.0)
    level = align(facing, start, False, fine=True)
    as_good = overlap_score(facing, level) >= overlap_score(facing, pose) - _AS_GOOD
    return level if as_good else pose


def _explore(
    facing: FacingPair, settings: OverlapSettings, x_px: tuple[float, float]
) -> ScoreMap | None:
    """Score all offsets that may be; None where there are none."""
    narrowest = round(settings.min_overlap_deg * facing.px_per_deg)
    # One row more on either side tells a peak from a slope that goes on.
    rise = round(settings.max_rise_deg * facing.px_per_deg) + 1
    level = round(facing.level_y_px)
    width, right_width = facing.left.image.shape[1], facing.right.image.shape[1]
    low, high = (int(np.clip(x / facing.step, -1e6, 1e6)) for x in x_px)
    x = range(max(narrowest - right_width, low), min(width - narrowest, high) + 1)
    if not x:
        return None
    return correlate(facing, x, range(level - rise, level + rise + 1))


def _verify(
    facing: FacingPair,
    landscape: ScoreMap,
    offsets: Collection[tuple[int, int]],
    tilt: bool,
) -> Registration:
    """Align the promising offsets, and tell the best of them from any other."""
    apart = _APART_DEG * facing.px_per_deg
    promising = landscape.score.max() - _CLOSE
    verified = []
    for x, y in sorted(offsets, key=lambda offset: -landscape.score_at(*offset)):
        known = any(abs(x - one.x_px) <= apart for _, one in verified)
        if known or len(verified) == _MOST_VERIFIED or landscape.score_at(x, y) < promising:
            continue
        verified.append(_align(facing, Pose(float(x), float(y)), tilt))
    if not verified:
        return Registration(Pose(0.0, 0.0))
    fit, pose = max(verified, key=itemgetter(0))
    rivals = [landscape.best_away_from(pose.x_px, apart)]
    rivals += [(other, one.x_px) for other, one in verified if abs(one.x_px - pose.x_px) > apart]
    return Registration(pose, fit, *max(rivals))


def _align(facing: FacingPair, level: Pose, tilt: bool) -> tuple[float, Pose]:
    """Align an offset, and tell how well that fits; level where that fits clearly better."""
    pose = align(facing, level, tilt)
    fit, level_fit = overlap_score(facing, pose), overlap_score(facing, level)
    return (level_fit, level) if level_fit > fit + _CLEARLY else (fit, pose)
