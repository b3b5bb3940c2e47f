"""What overlap calibration finds out about two neighbouring cameras."""

from dataclasses import dataclass
from math import nan

from fisheye_geometry.remap import LEVEL, Turn
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.particles import Particle


@dataclass(frozen=True)
class Overlap:
    """Where the right picture lies in the left one, and how sure that is.

    Attributes
    ----------
    method
        What decided, one of `METHODS`; 'manual' where a person did, '' where nothing did yet.
    found
        False: no common scene; the offset puts the pictures side by side.
    offset_x_px, offset_y_px
        Where the right picture's upper left corner lies in the left picture, after the right
        camera was turned by `turn`.
    turn
        The right camera's small turn that closes the seam; level where not measured.
    overlap_px
        Columns that both pictures fill.
    confidence
        0 to 1: zero-mean normalised cross-correlation of the structure of the overlap, lowered
        where a second offset is nearly as good.
    min_correlation_value
        The paper's measure for the matched particles; NaN where none matched.
    left_particles, right_particles
        What was found in the facing halves.
    left_match, right_match
        Indices of the matched pair, -1 where none matched.
    message
        One sentence for a person.
    stamp_ns
        When the newest pictures were taken that it was measured on; 0 if it was not measured now.
    """

    method: str
    found: bool
    offset_x_px: float
    offset_y_px: float
    turn: Turn = LEVEL
    overlap_px: float = 0.0
    confidence: float = 0.0
    min_correlation_value: float = nan
    left_particles: tuple[Particle, ...] = ()
    right_particles: tuple[Particle, ...] = ()
    left_match: int = -1
    right_match: int = -1
    message: str = ''
    stamp_ns: int = 0


def yaw_between_rad(offset_x_px: float, left: Surface, right: Surface) -> float:
    """Give the angle between the optical axes of two neighbours at an offset.

    Parameters
    ----------
    offset_x_px
        Where the right picture's left edge lies in the left picture.
    left, right
        What the pictures are on, with one focal length.

    Returns
    -------
    float
        rad; NaN on a rectilinear surface, where an offset is no angle.
    """
    if not left.yaw_is_column_shift:
        return nan
    return (offset_x_px + right.center_x_px - left.center_x_px) / left.focal_px


def side_by_side(surface_left: Surface, method: str, message: str) -> Overlap:
    """Give the overlap of views that share nothing: whole, one beside the other."""
    return Overlap(
        method=method,
        found=False,
        offset_x_px=float(surface_left.width),
        offset_y_px=0.0,
        message=message,
    )
