"""An offset that a person set in place of the one that was measured."""

from dataclasses import replace
from math import isnan

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, common_px, offset_px


def overlap_by_hand(
    measured: Overlap,
    x_px: float,
    y_px: float,
    left: Surface,
    right: Surface,
    attitudes: tuple[Attitude, Attitude],
) -> Overlap:
    """Return an overlap with an offset that a person set.

    Parameters
    ----------
    measured
        What there is without.
    x_px, y_px
        The offset; NaN leaves a part as it was measured.
    left, right
        What the corrected images of both are on.
    attitudes
        Level ones of both cameras; where no attitude was measured, what is set turns the right
        one from there.
    """
    if isnan(x_px) and isnan(y_px):
        return measured
    found = measured.found or not (isnan(x_px) or x_px == measured.offset_x_px)
    former_px = measured.offset_x_px, measured.offset_y_px
    is_turn = found and left.yaw_is_column_shift
    if is_turn and measured.attitude:
        # Only the left one is taken as it is drawn: a ring spreads what its rotations miss.
        turned = attitudes[0].matrix @ measured.attitude.matrix
        attitudes = attitudes[0], Attitude.of(turned)
    elif is_turn:
        former_px = offset_px(left, right, attitudes)
    x_px, y_px = (
        former if isnan(value) else value
        for former, value in zip(former_px, (x_px, y_px), strict=True)
    )
    attitude = None
    if is_turn:
        by_px = x_px - former_px[0], y_px - former_px[1]
        attitude = _moved(attitudes, by_px, right)
    return replace(
        measured,
        method='manual',
        found=found,
        offset_x_px=x_px,
        offset_y_px=y_px,
        attitude=attitude,
        overlap_px=common_px(x_px, left, right),
        message='set by hand',
    )


def _moved(
    attitudes: tuple[Attitude, Attitude], by_px: tuple[float, float], surface: Surface
) -> Attitude:
    """Move the image of the right one of two level attitudes; return it in the left one's frame.

    As the offset does, it turns about the level vertical, and its horizon is moved.
    """
    left, right = attitudes
    moved = Attitude(
        right.yaw_rad + by_px[0] / surface.focal_px,
        surface.depression_rad(surface.row_px(right.pitch_rad) - by_px[1]),
        right.roll_rad,
    )
    return Attitude.of(left.matrix.T @ moved.matrix)
