"""What overlap calibration finds out about two neighbouring cameras."""

from dataclasses import dataclass, replace
from math import degrees, nan, radians

import numpy as np

from fisheye_geometry.attitude import Attitude, rotation_matrix
from fisheye_geometry.rig import bearing_rad
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.particles import Particle

_SHOWN_RAD = radians(0.1)
"""Angles that differ by less are one for a person."""


@dataclass(frozen=True)
class Overlap:
    """Where the right image lies in the left one, and how sure that is.

    Attributes
    ----------
    method
        What decided, one of `METHODS`; 'manual' where a person did, '' where nothing did yet.
    found
        False: no common scene; the offset puts the images side by side.
    offset_x_px, offset_y_px
        Where the right image's upper left corner lies in the left image at the horizon; of a
        rotation it follows once the rig is level.
    attitude
        Of the right camera in the frame of the left one; None where only an offset is known.
    overlap_px
        Columns that both images fill.
    confidence
        0 to 1: by particles the probability that it is right within half a degree; else the
        correlation of the overlap, lowered where a second offset is nearly as good.
    near_deg
        How far near things lie beside far ones.
    min_correlation_value
        The paper's measure for the matched particles; NaN where none matched.
    left_particles, right_particles
        What was found in the facing halves.
    left_match, right_match
        Indices of the matched pair, -1 where none matched.
    message
        One sentence for a person.
    stamp_ns
        When the newest images were taken that it was measured on; 0 if it was not measured now.
    """

    method: str
    found: bool
    offset_x_px: float = nan
    offset_y_px: float = nan
    attitude: Attitude | None = None
    overlap_px: float = 0.0
    confidence: float = 0.0
    near_deg: float = 0.0
    min_correlation_value: float = nan
    left_particles: tuple[Particle, ...] = ()
    right_particles: tuple[Particle, ...] = ()
    left_match: int = -1
    right_match: int = -1
    message: str = ''
    stamp_ns: int = 0


def aligned_at(matrix: np.ndarray, distance_m: float, baseline_m: float) -> np.ndarray:
    """Return the rotation (3, 3) with which both views agree at a distance instead of far away.

    Lenses that are apart see near things turned towards each other: there the views agree where
    the right one is turned by baseline / distance about the normal of both axes.

    Parameters
    ----------
    matrix
        (3, 3), right rays to left ones, with which they agree far away.
    distance_m, baseline_m
        Where they shall agree, and how far the lenses are apart.
    """
    axis = np.cross((0.0, 0.0, 1.0), matrix[:, 2])
    return rotation_matrix(axis / np.linalg.norm(axis) * (baseline_m / distance_m)) @ matrix


def yaw_between_rad(offset_x_px: float, left: Surface, right: Surface) -> float:
    """Return the angle between the optical axes of two neighbours at an offset.

    Parameters
    ----------
    offset_x_px
        Where the right image's left edge lies in the left image.
    left, right
        What the images are on, with one focal length.

    Returns
    -------
    float
        rad; NaN on a rectilinear surface, where an offset is no angle.
    """
    if not left.yaw_is_column_shift:
        return nan
    return (offset_x_px + right.center_x_px - left.center_x_px) / left.focal_px


def side_by_side(surface_left: Surface, method: str, message: str) -> Overlap:
    """Return the overlap of views that share nothing: whole, one beside the other."""
    return Overlap(
        method=method,
        found=False,
        offset_x_px=float(surface_left.width),
        offset_y_px=0.0,
        message=message,
    )


def common_px(offset_x_px: float, left: Surface, right: Surface) -> float:
    """Return how many columns the images of two neighbours share at an offset."""
    begin_px, end_px = max(0.0, offset_x_px), min(left.width, offset_x_px + right.width)
    return max(0.0, end_px - begin_px)


def attitude_at(
    offset_x_px: float, offset_y_px: float, left: Surface, right: Surface, tilt: Attitude
) -> Attitude | None:
    """Return the right camera's attitude in the left one's frame that an offset means.

    Parameters
    ----------
    offset_x_px, offset_y_px
        Where the right image's upper left corner lies in the left image.
    left, right
        What the images are on, with one focal length.
    tilt
        The right camera's pitch and roll with which the offset is meant.

    Returns
    -------
    Attitude or None
        None on a plane, where an offset is no angle.
    """
    if not left.yaw_is_column_shift:
        return None
    yaw_rad = yaw_between_rad(offset_x_px, left, right)
    higher_rad = right.depression_rad(left.center_y_px - offset_y_px)
    return Attitude(yaw_rad, tilt.pitch_rad + higher_rad, tilt.roll_rad)


def with_offset(
    overlap: Overlap, left: Surface, right: Surface, attitudes: tuple[Attitude, Attitude]
) -> Overlap:
    """Return an overlap with the offset that the level attitudes of both cameras mean.

    Parameters
    ----------
    overlap
        It.
    left, right
        What the corrected images of both are on.
    attitudes
        Of the left and of the right camera.
    """
    if overlap.attitude is None:
        return overlap
    yaw_rad = bearing_rad(*attitudes)
    x_px, y_px = offset_px(left, right, attitudes)
    message = overlap.message
    if abs(yaw_rad - overlap.attitude.yaw_rad) > _SHOWN_RAD:
        message += f'; {degrees(yaw_rad):.2f} degrees about the level vertical'
    return replace(
        overlap,
        message=message,
        offset_x_px=x_px,
        offset_y_px=y_px,
        overlap_px=common_px(x_px, left, right),
    )


def on_surfaces(
    overlap: Overlap, then: tuple[Surface, Surface], now: tuple[Surface, Surface]
) -> Overlap:
    """Return an overlap with the offset that it means on other surfaces of the same cameras.

    Parameters
    ----------
    overlap
        One with an attitude, which stays as it is, or one that was not found.
    then, now
        What the corrected images of the left and the right camera were on, and are on; all of one
        kind.
    """
    if then == now:
        return overlap
    left, right = now
    if not overlap.found:
        return replace(overlap, offset_x_px=float(left.width))
    zoom = left.focal_px / then[0].focal_px
    x_px = zoom * (overlap.offset_x_px - then[0].center_x_px + then[1].center_x_px)
    y_px = zoom * (overlap.offset_y_px - then[0].center_y_px + then[1].center_y_px)
    x_px += left.center_x_px - right.center_x_px
    return replace(
        overlap,
        offset_x_px=x_px,
        offset_y_px=y_px + left.center_y_px - right.center_y_px,
        overlap_px=common_px(x_px, left, right),
    )


def offset_px(
    left: Surface, right: Surface, attitudes: tuple[Attitude, Attitude]
) -> tuple[float, float]:
    """Return the offset (x, y) that the level attitudes of both cameras mean.

    Parameters
    ----------
    left, right
        What the corrected images of both are on.
    attitudes
        Of the left and of the right camera.
    """
    x_px = bearing_rad(*attitudes) * left.focal_px + left.center_x_px - right.center_x_px
    horizons_px = [
        surface.row_px(attitude.pitch_rad)
        for surface, attitude in zip((left, right), attitudes, strict=True)
    ]
    return x_px, horizons_px[0] - horizons_px[1]
