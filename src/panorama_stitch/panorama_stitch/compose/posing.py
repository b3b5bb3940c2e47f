"""Posing: the views of a rig, from its attitudes or from offsets between corrected pictures."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from fisheye_geometry.attitude import LEVEL
from fisheye_geometry.rig import Rig
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.overlap_result import Overlap, yaw_between_rad


def views_of_rig(
    rig: Rig,
    surfaces: Sequence[Surface],
    *,
    interpolation: str = 'linear',
    seen: Sequence[np.ndarray | None] = (),
    bodies: Sequence[np.ndarray | None] = (),
) -> list[View]:
    """Return the views of a rig's cameras.

    Parameters
    ----------
    rig
        In its level frame. Pairs that are apart stand side by side, whole.
    surfaces
        The corrected picture of each camera alone, of one kind and focal length.
    interpolation, seen, bodies
        As of `View`; () for None everywhere.
    """
    nothing = (None,) * len(rig.cameras)
    shifts_px = [0.0]
    for index, (left, right) in enumerate(pairwise(surfaces)):
        beside_px = left.width + right.center_x_px - left.center_x_px
        shifts_px.append(shifts_px[-1] + (beside_px if index in rig.apart else 0.0))
    return [
        View(
            camera.source,
            surface,
            interpolation,
            camera.attitude,
            (shift_px - shifts_px[-1] / 2, 0.0),
            *masks,
        )
        for camera, surface, shift_px, *masks in zip(
            rig.cameras, surfaces, shifts_px, seen or nothing, bodies or nothing, strict=True
        )
    ]


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
    for left, right, overlap in zip(views[:-1], views[1:], overlaps, strict=True):
        step_rad = yaw_between_rad(overlap.offset_x_px, left.surface, right.surface)
        is_turn = overlap.found and left.surface.yaw_is_column_shift
        top_px += overlap.offset_y_px
        beside_px = overlap.offset_x_px + right.surface.center_x_px - left.surface.center_x_px
        yaws.append(yaws[-1] + (step_rad if is_turn else 0.0))
        x_px = shifts[-1][0] + (0.0 if is_turn else beside_px)
        y_px = top_px + right.surface.center_y_px - views[0].surface.center_y_px
        shifts.append(np.array([x_px, y_px]))
    # Straight ahead is midway between the outer cameras.
    middle = np.array([shifts[-1][0] / 2, 0.0])
    turns = [LEVEL, *(overlap.attitude or LEVEL for overlap in overlaps)]
    return [
        replace(
            view,
            attitude=replace(turn, yaw_rad=yaw - yaws[-1] / 2),
            shift_px=(float(shift[0] - middle[0]), float(shift[1] - middle[1])),
        )
        for view, turn, yaw, shift in zip(views, turns, yaws, shifts, strict=True)
    ]
