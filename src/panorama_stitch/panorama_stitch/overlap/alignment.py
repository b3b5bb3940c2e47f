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


def align(facing: FacingPair, start: Pose, tilt: bool, *, fine: bool = False) -> Pose:
    """Find the pose around a start, which stays where the overlap tells nothing better.

    Parameters
    ----------
    facing
        The structures.
    start
        Where to begin, px of these pictures.
    tilt
        Whether the right camera may be turned.
    fine
        Whether the start is nearly right already, and not just an offset of a level rig.
    """
    search_rad = _FINE_RAD if fine else _SEARCH_RAD
    tiles = Tiles(facing, start, search_rad, tilt)
    if not len(tiles):
        return start
    step = tiles.climb(np.zeros(4) if fine else tiles.search())
    pose = start.moved(step)
    # No rig needs more.
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
