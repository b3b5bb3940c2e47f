"""Print a calibration target true to scale, with its dimensions and a ruler on the sheet."""

from pathlib import Path

import cv2
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

from fisheye_core.errors import SettingError
from fisheye_undistort.report.figure_file import check_suffix, write_figure
from fisheye_undistort.target.marker_dictionary import dictionary_named
from fisheye_undistort.target.target import Target

_PAPERS_MM = {
    'A4': (210, 297),
    'A3': (297, 420),
    'A2': (420, 594),
    'A1': (594, 841),
    'A0': (841, 1189),
}
_MARGIN_MM = 8.0
"""What printers leave white, and what a pattern needs around it."""
_STRIP_MM = 14.0
"""Room for the ruler and the text, left of the pattern."""
_RULER_MM = 100
_MM_PER_INCH = 25.4
_POINTS_PER_MM = 72 / _MM_PER_INCH
_DOT_SIDES = 0.17
"""Radius of a chessboard's dots, in sides of its squares: OpenCV averages 1/7, white from 1/5."""


def write_sheet(path: str | Path, target: Target) -> str:
    """Write a target as PDF, SVG or PNG, true to scale, and give the name of its paper.

    Raises
    ------
    SettingError
        For a suffix that is no format of a figure, and for a target that fits no paper.
    FileAccessError
        If the file cannot be written.
    """
    path = Path(path)
    check_suffix(path, 'a sheet')
    paper, size_mm = paper_for(target)
    write_figure(_draw(target, paper, size_mm), path, dpi=300)
    return paper


def sheet_picture(target: Target, px_per_mm: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the sheet as an image.

    Returns
    -------
    picture : ndarray
        (height, width) uint8.
    origin_px : ndarray
        (2,) where the origin of the target's frame lies, px.
    """
    paper, (width, height) = paper_for(target)
    figure = _draw(target, paper, (width, height))
    # A hair more, or rounding down costs a row of pixels.
    figure.set_dpi(px_per_mm * _MM_PER_INCH * (1 + 1e-9))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = cv2.cvtColor(np.asarray(canvas.buffer_rgba()), cv2.COLOR_RGBA2GRAY)
    # Picture borders lie half a pixel before the first pixel's centre.
    return picture, np.array([(width + _STRIP_MM) / 2, height / 2]) * px_per_mm - 0.5


def paper_for(target: Target) -> tuple[str, tuple[float, float]]:
    """Name and (width, height) in mm of the smallest A paper that holds the sheet.

    Raises
    ------
    SettingError
        If even A0 is too small.
    """
    width, height = _pattern_size(target) + 2 * _MARGIN_MM + (_STRIP_MM, 0.0)
    height = max(height, _RULER_MM + 2 * _MARGIN_MM)
    for name, (short, long) in _PAPERS_MM.items():
        for size in ((long, short), (short, long)):
            if width <= size[0] and height <= size[1]:
                return name, size
    raise SettingError(f'the target takes {width:.0f} x {height:.0f} mm; A0 is the largest paper')


def _pattern_size(target: Target) -> np.ndarray:
    """Width and height of what is printed dark, mm."""
    border = 2 * {
        'aprilgrid': target.dx_mm - target.marker_mm,
        'chessboard': target.dx_mm,
        'charuco': target.dx_mm,
    }.get(target.kind, target.radius_mm)
    return np.ptp(target.points_mm[:, :2], axis=0) + border


def _draw(target: Target, paper: str, size_mm: tuple[float, float]) -> Figure:
    """Draw the page on axes whose unit is 1 mm; the origin is the target's."""
    width, height = size_mm
    figure = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH))
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set_axis_off()
    left = -(width + _STRIP_MM) / 2
    axes.set(xlim=(left, left + width), ylim=(height / 2, -height / 2))
    for shape in _SHAPES[target.kind](target):
        # Nothing may move to the next whole pixel.
        axes.add_patch(shape).set_snap(False)
    edge = left + _MARGIN_MM
    _ruler(axes, edge)
    text = f'{target}\n{paper}: print at 100 % ("actual size") and check the ruler'
    axes.text(edge + 5.5, 0, text, rotation=90, ha='left', va='center', fontsize=8)
    return figure


def _circles(target: Target):
    centers = target.points_mm[:, :2]
    return [Circle(center, target.radius_mm, color='black', lw=0) for center in centers]


def _chessboard(target: Target):
    """Squares, and the dots that tell where a part of the board belongs."""
    yield from _squares(target)
    left, top, _ = target.points_mm[0] - target.dx_mm / 2
    for row, column in target.dotted_squares:
        color = 'white' if (row + column) % 2 == 0 else 'black'
        center = left + column * target.dx_mm, top + row * target.dx_mm
        yield Circle(center, _DOT_SIDES * target.dx_mm, color=color, lw=0)


def _squares(target: Target):
    """Dark squares of a chessboard, and the markers in the white ones of a ChArUco board."""
    side = target.dx_mm
    rows, columns = (n + (target.kind == 'chessboard') for n in (target.rows, target.columns))
    corner = -np.array([columns, rows]) * side / 2
    markers = _marker_cells(target, 1) if target.has_markers else None
    first = target.legacy and rows % 2 == 0
    for row, column in np.ndindex(rows, columns):
        x, y = corner + np.array([column, row]) * side
        if (row + column) % 2 == first:
            yield Rectangle((x, y), side, side, color='black', lw=0)
        elif markers:
            yield from _marker(next(markers), x + side / 2, y + side / 2, target.marker_mm)


def _tags(target: Target):
    """Tags as Kalibr's grid has them: the first at the bottom left, squares at their corners."""
    cells = [*zip(range(target.rows * target.columns), _marker_cells(target, 2), strict=False)]
    side, gap = target.marker_mm, target.dx_mm - target.marker_mm
    corners = target.points_mm[:, :2].reshape(2 * target.rows, 2 * target.columns, 2)
    for number, black in cells:
        row, column = target.rows - 1 - number // target.columns, number % target.columns
        x, y = corners[2 * row, 2 * column]
        # White on black: what is drawn must end exactly where the corner is. Kalibr's tags stand
        # upside down in OpenCV's dictionary.
        yield Rectangle((x, y), side, side, color='black', lw=0)
        yield from _marker(~black[::-1, ::-1], x + side / 2, y + side / 2, side, 'white')
    for row, column in np.ndindex(target.rows + 1, target.columns + 1):
        x, y = corners[0, 0] + np.array([column, row]) * target.dx_mm - gap
        yield Rectangle((x, y), gap, gap, color='black', lw=0)


_SHAPES = {
    'circles': _circles,
    'acircles': _circles,
    'chessboard': _chessboard,
    'charuco': _squares,
    'aprilgrid': _tags,
}
"""What is printed dark."""


def _marker_cells(target: Target, border: int):
    """Black cells of one marker after another, (n, n) bool each, with a border of black ones."""
    dictionary = dictionary_named(target.dictionary)
    side = dictionary.markerSize
    unpack = cv2.aruco.Dictionary_getBitsFromByteList
    return (
        np.pad(unpack(code[None], side) == 0, border, constant_values=True)
        for code in dictionary.bytesList
    )


def _marker(cells: np.ndarray, x: float, y: float, size: float, color: str = 'black'):
    cell = size / len(cells)
    for row, column in np.argwhere(cells):
        corner = (x - size / 2 + column * cell, y - size / 2 + row * cell)
        # The thin outline closes the hairlines that viewers leave between neighbours.
        yield Rectangle(corner, cell, cell, color=color, lw=0.05 * _POINTS_PER_MM)


def _ruler(axes, x: float) -> None:
    """Draw a vertical ruler that tells whether the printer kept the scale."""
    thin = 0.2 * _POINTS_PER_MM
    start = -_RULER_MM / 2
    axes.plot([x, x], [start, -start], color='black', lw=thin)
    for mm in range(_RULER_MM + 1):
        length = 4 if mm % 10 == 0 else 2.5 if mm % 5 == 0 else 1.5
        axes.plot([x, x + length], [start + mm] * 2, color='black', lw=thin)
    axes.text(x, start - 1, f'{_RULER_MM} mm', rotation=90, fontsize=7, ha='left', va='bottom')
