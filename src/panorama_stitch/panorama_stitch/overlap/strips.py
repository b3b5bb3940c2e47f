"""The overlap of two views, drawn so that nearness moves things along rows alone.

A seam frame has x along the line between the lenses, z midway between the optical axes. The strips
are equirectangular about x: columns are angles `u` towards the right camera, rows are angles
`v` around the line. What is near lies further right in the left strip, on the same row.
"""

from dataclasses import dataclass

import numpy as np

from panorama_stitch.overlap.view import OverlapView

_WIDEST_RAD = np.radians(36)
"""To either side of the seam; more of a wide overlap tells no more."""


@dataclass(frozen=True, eq=False)
class Strip:
    """What one camera shows of the seam: (rows, columns) float32 and uint8, 0 where nothing."""

    image: np.ndarray
    valid: np.ndarray


@dataclass(frozen=True, eq=False)
class Strips:
    """The overlap in both views.

    Attributes
    ----------
    left, right
        What they show, with one another in place if the rotation is right and all is far.
    frame
        (3, 3) axes of the seam as columns, in the left camera's optical frame.
    u_rad, v_rad
        (columns,), (rows,) what they look at.
    density
        Pixels per radian.
    """

    left: Strip
    right: Strip
    frame: np.ndarray
    u_rad: np.ndarray
    v_rad: np.ndarray
    density: float


def seam_frame(rotation: np.ndarray) -> np.ndarray:
    """Return the axes (3, 3), as columns, of the seam of two cameras that look outwards."""
    here, there = np.array([0.0, 0.0, 1.0]), rotation[:, 2]
    x = there - here
    if np.linalg.norm(x) < 1e-6:  # both look the same way: the seam is any upright one
        x = np.array([1.0, 0.0, 0.0])
    x /= np.linalg.norm(x)
    middle = here + there
    if np.linalg.norm(middle) < 0.1:  # back to back: any direction around is as good
        middle = np.array([0.0, -1.0, 0.0])
    z = middle - x * (middle @ x)
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=-1)


def seam_rays(u_rad: np.ndarray, v_rad: np.ndarray) -> np.ndarray:
    """Rays (..., 3) of the seam frame at angles that broadcast against each other."""
    side = np.cos(u_rad)
    parts = np.broadcast_arrays(np.sin(u_rad), side * np.sin(v_rad), side * np.cos(v_rad))
    return np.stack(parts, axis=-1)


def draw_strips(
    left: OverlapView,
    right: OverlapView,
    rotation: np.ndarray,
    density: float,
    usable=(None, None),
) -> Strips | None:
    """Draw the overlap of two views; None where there is none.

    Parameters
    ----------
    left, right
        The views.
    rotation
        (3, 3) right rays to left ones.
    density
        Pixels per radian.
    usable
        Of either view: (height, width) uint8, 255 where it may be used.
    """
    frame = seam_frame(rotation)
    both = _common(left, right, frame, rotation, usable)
    if both is None:
        return None
    (low_u, high_u), (low_v, high_v) = both
    u = np.arange(low_u, high_u, 1 / density)
    v = np.arange(low_v, high_v, 1 / density)
    rays = seam_rays(u, v[:, None]) @ frame.T
    smooth = 0.4 * max(left.density, right.density) / density
    strips = []
    for view, seen, turned in zip((left, right), usable, (rays, rays @ rotation), strict=True):
        image, valid = view.sample(turned, seen, smooth)
        strips.append(Strip(image.astype(np.float32), valid.astype(np.uint8)))
    return Strips(*strips, frame, u, v, density)


def _common(left, right, frame, rotation, usable):
    """Ranges of u and v that both views see, looked up on a coarse grid."""
    step = np.radians(2.0)
    u = np.arange(-_WIDEST_RAD, _WIDEST_RAD, step)
    v = np.arange(-np.pi, np.pi, step)
    rays = seam_rays(u, v[:, None]) @ frame.T
    seen = left.sample(rays, usable[0])[1] & right.sample(rays @ rotation, usable[1])[1]
    if np.count_nonzero(seen) < 12:
        return None
    ranges = []
    for angles, axis in ((u, 0), (v, 1)):
        inside = angles[seen.any(axis=axis)]
        ranges.append((max(inside[0] - step, angles[0]), inside[-1] + step))
    return ranges
