"""The pose of the right picture that closes the seam from top to bottom, and how sure it is.

The overlap is cut into tiles, and each is correlated with where it may lie in the left picture. A
tilted camera shifts the tiles along the seam differently, which no single offset can follow: the
pose is sought at which the tiles together fit best.
"""

from math import ceil, floor, radians

import cv2
import numpy as np

from panorama_stitch.overlap.correlation import significance_corrected
from panorama_stitch.overlap.pose import Pose
from panorama_stitch.overlap.structure import FacingPair
from panorama_stitch.overlap.tiles import Tiles

_SEARCH_RAD, _FINE_RAD = radians(3.2), radians(0.8)
"""How far from where it is expected each tile of the overlap is looked for."""
_STEEPEST_RAD = radians(4.0)
"""No mount is that far off: it would be a false match."""
_STRIDE = 2
"""Every second pixel is enough to correlate two smooth pictures."""


def align(facing: FacingPair, start: Pose, tilt: bool) -> Pose:
    """Find the pose around an offset of a level rig.

    The start stays where the overlap tells nothing better.

    Parameters
    ----------
    facing
        The structures.
    start
        Where to begin, px of these pictures.
    tilt
        Whether the right camera may be turned.
    """
    tiles = Tiles(facing, start, _SEARCH_RAD, tilt)
    return (
        _checked(facing, start, tiles.climb(tiles.search()), _SEARCH_RAD) if len(tiles) else start
    )


def refine(facing: FacingPair, start: Pose, tilt: bool) -> Pose:
    """Improve a pose that is nearly right already; parameters as of `align`."""
    tiles = Tiles(facing, start, _FINE_RAD, tilt)
    return _checked(facing, start, tiles.climb(np.zeros(4)), _FINE_RAD) if len(tiles) else start


def _checked(facing, start, step, search_rad) -> Pose:
    """Accept a step from the start if it is one that a rig can need."""
    pose = start.moved(step)
    too_far = max(abs(step[:2])) > search_rad * facing.surface.focal_px
    too_steep = max(abs(pose.pitch_rad), abs(pose.roll_rad)) > _STEEPEST_RAD
    return start if too_far or too_steep else pose


def overlap_score(facing: FacingPair, pose: Pose) -> float:
    """Correlate the overlap of two structures at a pose, less what chance may give; 0 to 1."""
    left, right = facing.left, facing.right
    height, width = right.image.shape
    x0 = max(0, floor(-pose.x_px) - _STRIDE)
    x1 = min(width, ceil(left.image.shape[1] - pose.x_px) + _STRIDE)
    part = slice(0, height, _STRIDE), slice(x0, max(x1, x0), _STRIDE)
    y, x = np.mgrid[part]
    if not x.size:
        return 0.0
    points = np.stack([x.ravel(), y.ravel()], axis=-1).astype(float)
    places = pose.place(facing.surface, points).astype(np.float32).reshape(*x.shape, 2)
    theirs = cv2.remap(left.image, places, None, cv2.INTER_LINEAR)
    seen = cv2.remap(left.valid, places, None, cv2.INTER_NEAREST) & right.valid[part]
    theirs, mine = theirs[seen > 0], right.image[part][seen > 0]
    energy = float(np.sqrt((mine @ mine) * (theirs @ theirs)))
    correlation = float(mine @ theirs) / max(energy, 1.0)
    return max(0.0, float(significance_corrected(correlation, energy * _STRIDE**2)))
