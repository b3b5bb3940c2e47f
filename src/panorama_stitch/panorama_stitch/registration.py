"""Registration of two views: offsets are proposed, verified on their structure, and refined."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
from fisheye_geometry.surface import Surface

from panorama_stitch.alignment import align, certainty
from panorama_stitch.correlation import Landscape, correlate
from panorama_stitch.pose import Pose
from panorama_stitch.proposals import Proposals, propose
from panorama_stitch.structure import Facing, face, plain, structure

_SEARCH_PX_PER_DEG, _FINE_PX_PER_DEG = 2.0, 4.0
_TILE_SEARCH_DEG, _FINE_SEARCH_DEG = 3.2, 0.8
_APART_DEG = 3.0
"""Offsets nearer to each other are the same answer."""
_CANDIDATES = 8
_CLOSE = 0.15
"""An offset whose score is this much below the best one may still be the right one."""
_DISTINCT = 1.3
"""Any other offset leaves at least this much more unexplained where the scene is distinct."""


@dataclass(frozen=True)
class Search:
    """What is known before anything is seen.

    Attributes
    ----------
    x_px
        Smallest and largest offset of the right half in the left one.
    max_rise_deg
        How far the right view may lie above or below the left one.
    min_overlap_deg
        Narrowest overlap to look for.
    tilt
        Whether the right camera may be turned.
    min_confidence
        Confidence at which an offset is taken for found.
    """

    x_px: tuple[float, float] = (-inf, inf)
    max_rise_deg: float = 4.0
    min_overlap_deg: float = 5.0
    tilt: bool = True
    min_confidence: float = 0.38


@dataclass(frozen=True)
class Registration:
    """Where the right half lies in the left one, if anywhere.

    Attributes
    ----------
    pose
        px of the halves.
    confidence
        0 to 1; where a second offset fits nearly as well it is lower than that fit.
    rival_x_px
        The second offset; None where there is none.
    proposals
        The particles that proposed it; None where the full search did.
    """

    pose: Pose
    confidence: float
    rival_x_px: float | None = None
    proposals: Proposals | None = None


_NOTHING = Registration(Pose(0.0, 0.0), 0.0)


def register(
    left: np.ndarray,
    right: np.ndarray,
    surface_left: Surface,
    surface_right: Surface,
    search: Search,
    *,
    by_particles: bool,
) -> Registration:
    """Find where the facing halves of two grey pictures overlap.

    Parameters
    ----------
    left, right
        (height, width) uint8, 0 where nothing is seen.
    surface_left, surface_right
        What they show.
    search
        Where to look.
    by_particles
        Whether particles propose the offsets, and the full search only where none of theirs holds.
    """
    pair = left, right, surface_left, surface_right
    facing = face(*pair, _SEARCH_PX_PER_DEG, structure)
    landscape = _explore(facing, search)
    result = _NOTHING
    if by_particles:
        proposals = propose(facing, search.max_rise_deg * _px_per_deg(facing))
        result = _verify(facing, landscape, proposals.offsets(landscape, _CANDIDATES), search.tilt)
        result = replace(result, proposals=proposals)
    if result.confidence < search.min_confidence:
        peaks = landscape.peaks(_CANDIDATES, round(_APART_DEG * _px_per_deg(facing)))
        result = _verify(facing, landscape, peaks, search.tilt)
    pose = result.pose.scaled(facing.step)
    if result.confidence >= search.min_confidence:
        fine = face(*pair, _FINE_PX_PER_DEG, plain)
        pose = align(fine, pose.scaled(1 / fine.step), _FINE_SEARCH_DEG, search.tilt)
        pose = pose.scaled(fine.step)
    rival = result.rival_x_px
    return replace(result, pose=pose, rival_x_px=None if rival is None else rival * facing.step)


def _px_per_deg(facing: Facing) -> float:
    return facing.surface.focal_px * np.pi / 180


def _explore(facing: Facing, search: Search) -> Landscape:
    """Score all offsets that may be."""
    narrowest = round(search.min_overlap_deg * _px_per_deg(facing))
    rise = round(search.max_rise_deg * _px_per_deg(facing))
    level = round(facing.level_y_px)
    (height, width), right_width = facing.left.image.shape, facing.right.image.shape[1]
    low, high = (int(np.clip(x / facing.step, -1e6, 1e6)) for x in search.x_px)
    x = range(max(narrowest - right_width, low), min(width - narrowest, high) + 1)
    if not x:
        return Landscape(np.zeros(1, int), np.zeros(1, int), np.full((1, 1), -1.0, np.float32))
    return correlate(facing, x, range(level - rise, level + rise + 1), narrowest * height / 4)


def _verify(
    facing: Facing, landscape: Landscape, offsets: Sequence[tuple[int, int]], tilt: bool
) -> Registration:
    """Align the promising offsets, and tell the best of them from any other."""
    promising = landscape.score.max() - _CLOSE
    verified = []
    for x, y in offsets:
        if landscape.score_at(x, y) >= promising:
            level = Pose(float(x), float(y))
            poses = level, align(facing, level, _TILE_SEARCH_DEG, tilt)
            verified.append(max((certainty(facing, pose), pose.x_px, pose) for pose in poses))
    if not verified:
        return _NOTHING
    best, best_x, pose = max(verified)
    apart = _APART_DEG * _px_per_deg(facing)
    rivals = [(landscape.best_away_from(best_x, apart))]
    rivals += [(sure, x) for sure, x, _ in verified if abs(x - best_x) > apart]
    rival, rival_x = max(rivals)
    distinct = (1 - rival) / max(1 - best, 1e-6)
    share = float(np.clip((distinct - 1) / (_DISTINCT - 1), 0, 1))
    return Registration(pose, best * share, rival_x if share < 1 else None)
