"""The pose of the right picture that closes the seam from top to bottom, and how sure it is.

The overlap is cut into tiles, and each is correlated with where it may lie in the left picture. A
tilted camera shifts the tiles along the seam differently, which no single offset can follow: the
pose is sought at which the tiles together fit best.
"""

from math import ceil, floor, radians

import cv2
import numpy as np
from fisheye_geometry.surface import Surface

from panorama_stitch.correlation import less_chance
from panorama_stitch.pose import Pose
from panorama_stitch.structure import Reduced
from panorama_stitch.tiles import Tiles

_FEWEST_TILES = 3
_STEEPEST_RAD = radians(6.0)
"""No mount is that far off: it would be a false match."""
_STRIDE = 2
"""Every second pixel is enough to correlate two smooth pictures."""


def align(
    left: Reduced,
    right: Reduced,
    surface: Surface,
    start: Pose,
    level_y_px: float,
    search_rad: float,
    tilt: bool = True,
) -> Pose:
    """Refine a pose; the one that was given where the overlap does not tell a better one.

    Parameters
    ----------
    left, right
        The two pictures at the same scale.
    surface
        The right one's.
    start
        The pose to refine, px of these pictures.
    level_y_px
        Vertical offset of a level rig.
    search_rad
        How far from where it is expected each tile of the overlap is looked for.
    tilt
        Whether the right camera may be turned.
    """
    tiles = Tiles(left, right, surface, start, level_y_px, search_rad, tilt)
    if len(tiles) < _FEWEST_TILES:
        return start
    pose = start.moved(tiles.climb(tiles.search()))
    shift = max(abs(pose.x_px - start.x_px), abs(pose.y_px - start.y_px))
    steep = max(abs(pose.pitch_rad), abs(pose.roll_rad)) > _STEEPEST_RAD
    return start if steep or shift > search_rad * surface.focal_px else pose


def certainty(left: Reduced, right: Reduced, surface: Surface, pose: Pose) -> float:
    """Correlate the overlap at a pose, less what chance gives an overlap of that size; 0 to 1."""
    height, width = right.image.shape
    x0 = max(0, floor(-pose.x_px) - _STRIDE)
    x1 = min(width, ceil(left.image.shape[1] - pose.x_px) + _STRIDE)
    y, x = np.mgrid[0:height:_STRIDE, x0:x1:_STRIDE]
    if not x.size:
        return 0.0
    places = pose.place(surface, np.stack([x.ravel(), y.ravel()], axis=-1).astype(float))
    map_x, map_y = places.astype(np.float32).T.reshape(2, *x.shape)
    mine = right.image[0:height:_STRIDE, x0:x1:_STRIDE]
    theirs = cv2.remap(left.image, map_x, map_y, cv2.INTER_LINEAR)
    seen = cv2.remap(left.valid, map_x, map_y, cv2.INTER_NEAREST)
    seen = (seen & right.valid[0:height:_STRIDE, x0:x1:_STRIDE]) > 0
    mine, theirs = mine[seen], theirs[seen]
    energy = float(np.sqrt((mine @ mine) * (theirs @ theirs)))
    correlation = float(mine @ theirs) / max(energy, 1.0)
    area = _STRIDE * _STRIDE
    return max(0.0, float(less_chance(correlation, energy * area, mine.size * area)))
