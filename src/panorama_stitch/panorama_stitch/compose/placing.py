"""Placing: the surface around a rig, and the columns of each camera on it."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import inf, pi

import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_core.parallel import run_parallel
from fisheye_geometry.remap import on_picture
from fisheye_geometry.rig import unwrapped
from fisheye_geometry.surface import Surface
from fisheye_geometry.surface_kind import KINDS
from panorama_stitch.compose.placed import Placed, PlacedView
from panorama_stitch.compose.view import View

_WIDEST_STEP_RAD = np.radians(210)
"""No two neighbours of a ring are farther apart: not even 240 degree lenses would meet."""


def place(views: Sequence[View], *, wraps: bool = False) -> Placed:
    """Find the surface on which a rig's panorama lies, and draw nothing yet.

    Parameters
    ----------
    views
        From left to right; the first one decides the kind of surface, its focal length, and of
        an open panorama where pixels begin.
    wraps
        Whether the panorama leads all around: it is 360 degrees wide then, bearing 0 in its
        middle.

    Raises
    ------
    GeometryError
        If there is no such surface.
    """
    grid = _grid(views[0], wraps)
    axes = _axis_columns(views, grid)
    placed = [
        PlacedView(view, index, axis, *_columns(view, grid, axis))
        for index, (view, axis) in enumerate(zip(views, axes, strict=True))
    ]
    if axes[-1] < axes[0]:
        placed.reverse()
    rows = np.array([_rows(view, grid) for view in views])
    top, bottom = int(rows[:, 0].min()), int(rows[:, 1].max())
    if wraps:
        left, right = 0, grid.width
        for each in placed:
            each.end = min(each.end, each.begin + grid.width)
        if len(placed) == 1:
            placed[0].begin, placed[0].end = 0, grid.width
    else:
        left, right = min(p.begin for p in placed), max(p.end for p in placed)
        # No bearing is shown twice: both ends give way alike. Frames side by side are no bearings.
        is_rig = not any(view.shift_px[0] for view in views)
        most_px = grid.circumference_px if is_rig else inf
        excess = right - left - int(min(most_px, right - left))
        left, right = left + excess // 2, right - (excess - excess // 2)
        for each in placed:
            each.begin, each.end = max(each.begin, left) - left, min(each.end, right) - left
            each.axis -= left
    surface = grid.window(left, top, right - left, bottom - top)
    run_parallel([partial(each.prepare, surface) for each in placed])
    return Placed(surface, tuple(placed), wraps)


def leads_around(views: Sequence[View]) -> bool:
    """Whether the last view of a rig reaches the first one behind; a single one: itself."""
    surface = views[0].surface
    if not surface.yaw_is_column_shift or any(view.shift_px[0] for view in views):
        return False
    grid = _grid(views[0], wraps=True)
    axes = _axis_columns(views, grid)
    (first, _), (_, last) = _columns(views[0], grid, axes[0]), _columns(views[-1], grid, axes[-1])
    if len(views) == 1:
        return bool(last - first >= grid.width - 1)
    to_first = grid.width - (axes[-1] - axes[0])
    # A plain bool: in a message NumPy's own would be false.
    return bool(first + grid.width < last and 0 < to_first < _WIDEST_STEP_RAD * grid.focal_px)


def _grid(first: View, wraps: bool) -> Surface:
    """Return the surface whose pixels are those of the panorama, counted from somewhere."""
    surface = first.surface
    if not wraps:
        # The first camera's own pixels are kept, so that a level one is only shifted.
        axis = _axis_column(first, replace(surface, center_x_px=0.0))
        return replace(surface, center_x_px=surface.center_x_px - axis)
    if not surface.yaw_is_column_shift:
        raise GeometryError(
            f'a {surface.kind} surface cannot lead all around; expected one of '
            f'{", ".join(name for name, kind in KINDS.items() if kind.yaw_is_column_shift)}'
        )
    width = round(surface.circumference_px)
    return replace(surface, width=width, focal_px=width / (2 * pi), center_x_px=(width - 1) / 2)


def _axis_columns(views: Sequence[View], grid: Surface) -> list[float]:
    """Columns in which the cameras look along their axes, each right of the one before."""
    if not grid.yaw_is_column_shift:
        return [_axis_column(view, grid) for view in views]
    yaws = unwrapped([view.attitude.yaw_rad for view in views])
    return [
        grid.center_x_px + yaw * grid.focal_px + view.shift_px[0]
        for view, yaw in zip(views, yaws, strict=True)
    ]


def _axis_column(view: View, grid: Surface) -> float:
    """Column in which a camera looks along its axis."""
    if grid.yaw_is_column_shift:
        return grid.center_x_px + view.attitude.yaw_rad * grid.focal_px + view.shift_px[0]
    (x, _), _ = grid.project(view.attitude.matrix[:, 2])
    return float(x) + view.shift_px[0]


def _columns(view: View, grid: Surface, axis: float) -> tuple[int, int]:
    """Columns in which a camera sees the horizon, as far as that is wanted."""
    kind, focal_px = KINDS[grid.kind], grid.focal_px
    left, right, _, _ = view.field_rad()
    begin = round(axis - kind.column(left) * focal_px + 0.5)
    end = round(axis + kind.column(right) * focal_px + 0.5)
    columns = np.arange(begin, end)
    row = grid.center_y_px + view.shift_px[1]
    if not _sees(view, grid, np.array([axis]), row)[0]:
        row += KINDS[grid.kind].row(-view.attitude.pitch_rad) * focal_px
    sees = _sees(view, grid, columns, row)
    if not sees.any():
        return begin, end
    at = int(np.clip(round(axis) - begin, 0, len(columns) - 1))
    before, after = np.flatnonzero(~sees[: at + 1]), np.flatnonzero(~sees[at:])
    first = before[-1] + 1 if len(before) else 0
    last = at + after[0] if len(after) else len(columns)
    return begin + int(first), begin + int(max(last, first + 1))


def _sees(view: View, grid: Surface, columns: np.ndarray, row: float) -> np.ndarray:
    """Whether a camera sees anything at pixels of one row."""
    rays = grid.rays(columns - view.shift_px[0], row - view.shift_px[1])
    return on_picture(view.source, rays @ view.attitude.matrix)[1]


def _rows(view: View, grid: Surface) -> tuple[int, int]:
    """Rows that a camera shows straight ahead, as far as the surface goes up and down."""
    kind = KINDS[grid.kind]
    _, _, up, down = view.field_rad()
    pitch, steepest = view.attitude.pitch_rad, max(kind.steepest_rad, *view.own_field_rad()[2:])
    top, bottom = (
        grid.center_y_px + kind.row(float(np.clip(angle, -steepest, steepest))) * grid.focal_px
        for angle in (-up - pitch, down - pitch)
    )
    shift = view.shift_px[1]
    return round(top + shift + 0.5), round(bottom + shift + 0.5)
