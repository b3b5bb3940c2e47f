"""Posing: the attitudes of cameras that follow from offsets between their corrected pictures."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fisheye_geometry.attitude import Attitude
from panorama_stitch.compose.view import View
from panorama_stitch.overlap_result import Overlap, apart_rad


def views_at_overlaps(views: Sequence[View], overlaps: Sequence[Overlap]) -> list[View]:
    """Return the views with the attitudes that follow from the overlaps of neighbours.

    Parameters
    ----------
    views
        From left to right, level, on surfaces of one kind and focal length.
    overlaps
        One for each neighbouring pair. Where none was found, and on a plane, where a turn is no
        shift, the pictures are moved as they are.
    """
    yaws, shifts = [0.0], [np.zeros(2)]
    top_px = 0.0
    for left, right, overlap in zip(views, views[1:], overlaps, strict=False):
        step_rad = apart_rad(overlap.offset_x_px, left.surface, right.surface)
        is_turn = overlap.found and left.surface.yaw_is_column_shift
        top_px += overlap.offset_y_px
        beside_px = overlap.offset_x_px + right.surface.center_x_px - left.surface.center_x_px
        yaws.append(yaws[-1] + (step_rad if is_turn else 0.0))
        x_px = shifts[-1][0] + (0.0 if is_turn else beside_px)
        y_px = top_px + right.surface.center_y_px - views[0].surface.center_y_px
        shifts.append(np.array([x_px, y_px]))
    # Straight ahead is midway between the outer cameras.
    middle = np.array([shifts[-1][0] / 2, 0.0])
    turns = [Attitude(), *(overlap.turn for overlap in overlaps)]
    return [
        replace(
            view,
            attitude=replace(turn, yaw_rad=yaw - yaws[-1] / 2),
            shift_px=tuple(map(float, shift - middle)),
        )
        for view, turn, yaw, shift in zip(views, turns, yaws, shifts, strict=True)
    ]
