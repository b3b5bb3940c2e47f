"""Registration of two views: offsets are proposed, verified on their structure, and refined."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import inf, radians
from operator import itemgetter

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
_DISTINCT = 1.4
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
    min_confidence: float = 0.3


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
    px_per_deg = facing.surface.focal_px * radians(1)
    landscape = _explore(facing, search, px_per_deg)
    offsets = landscape.peaks(_CANDIDATES, round(_APART_DEG * px_per_deg))
    proposals, proposed = None, []
    if by_particles:
        proposals = propose(facing, search.max_rise_deg * px_per_deg)
        proposed = proposals.offsets(landscape, _CANDIDATES)
    result = _verify(facing, landscape, [*proposed, *offsets], search.tilt, px_per_deg)
    pose = result.pose.scaled(facing.step)
    if not any(abs(x - result.pose.x_px) <= _APART_DEG * px_per_deg for x, _ in proposed):
        proposals = None
    if result.confidence >= search.min_confidence:
        fine = face(*pair, _FINE_PX_PER_DEG, plain)
        pose = align(fine, pose.scaled(1 / fine.step), _FINE_SEARCH_DEG, search.tilt)
        pose = pose.scaled(fine.step)
    rival = None if result.rival_x_px is None else result.rival_x_px * facing.step
    return replace(result, pose=pose, rival_x_px=rival, proposals=proposals)


def _explore(facing: Facing, search: Search, px_per_deg: float) -> Landscape:
    """Score all offsets that may be."""
    narrowest = round(search.min_overlap_deg * px_per_deg)
    # One row more on either side tells a peak from a slope that goes on.
    rise = round(search.max_rise_deg * px_per_deg) + 1
    level = round(facing.level_y_px)
    (height, width), right_width = facing.left.image.shape, facing.right.image.shape[1]
    low, high = (int(np.clip(x / facing.step, -1e6, 1e6)) for x in search.x_px)
    x = range(max(narrowest - right_width, low), min(width - narrowest, high) + 1)
    if not x:
        return Landscape(np.zeros(1, int), np.zeros(1, int), np.full((1, 1), -1.0, np.float32))
    return correlate(facing, x, range(level - rise, level + rise + 1), narrowest * height / 4)


def _verify(
    facing: Facing,
    landscape: Landscape,
    offsets: Sequence[tuple[int, int]],
    tilt: bool,
    px_per_deg: float,
) -> Registration:
    """Align the promising offsets, and tell the best of them from any other."""
    promising = landscape.score.max() - _CLOSE
    verified = []
    for x, y in dict.fromkeys(offsets):
        if landscape.score_at(x, y) >= promising and landscape.y[0] < y < landscape.y[-1]:
            level = Pose(float(x), float(y))
            poses = level, align(facing, level, _TILE_SEARCH_DEG, tilt)
            tried = ((certainty(facing, pose), pose.x_px, pose) for pose in poses)
            verified.append(max(tried, key=itemgetter(0)))
    if not verified:
        return _NOTHING
    best, best_x, pose = max(verified, key=itemgetter(0))
    apart = _APART_DEG * px_per_deg
    rivals = [landscape.best_away_from(best_x, apart)]
    rivals += [(sure, x) for sure, x, _ in verified if abs(x - best_x) > apart]
    rival, rival_x = max(rivals)
    distinct = (1 - rival) / max(1 - best, 1e-6)
    share = float(np.clip((distinct - 1) / (_DISTINCT - 1), 0, 1))
    return Registration(pose, best * share, rival_x if share < 1 else None)
