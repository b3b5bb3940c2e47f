"""Calibration targets: what is printed on the sheet, and where its points lie."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_core.errors import SettingError
from fisheye_undistort.target.marker_dictionary import can_read_markers, dictionary_named

KINDS = ('circles', 'acircles', 'chessboard', 'charuco', 'aprilgrid')
MARKERS = 'DICT_4X4_250'
"""Dictionary of the markers on a `charuco` sheet where nothing else is said (OpenCV's name)."""
TAGS = 'DICT_APRILTAG_36h11'
"""Dictionary of the tags of an `aprilgrid`."""

_MAX_SIDE = 100
_MAX_SPACING_MM = 10_000
_SMALLEST_GAP_RADII = 2.5
"""Centres of neighbouring circles are this many radii apart at least: white must be between."""


@dataclass(frozen=True)
class Target:
    """A flat, printed pattern of points.

    Its frame has the sheet's middle as origin, x along the rows to the right, y down, z into the
    sheet, mm.

    Attributes
    ----------
    kind
        One of `KINDS`: filled circles on a regular grid, circles of which every other row is moved
        by half a column, inner corners of a chessboard, inner corners of a ChArUco board, corners
        of the tags of Kalibr's AprilTag grid.
    rows, columns
        Number of circles or inner corners; of a ChArUco board: of squares; of a grid: of tags.
    dx_mm, dy_mm
        Distance of neighbouring points (of `acircles`: of neighbouring rows, and half of that of
        neighbouring circles in one row), the squares' size, or from one tag to the next.
    radius_mm
        Of the circles.
    marker_mm
        Side of the markers of a ChArUco board, of the tags of a grid.
    dictionary
        OpenCV's name of the dictionary that the markers are from.
    legacy
        Whether a ChArUco board begins with a white square although its rows are even, as those
        that OpenCV before 4.6 drew.
    """

    kind: str
    rows: int
    columns: int
    dx_mm: float
    dy_mm: float
    radius_mm: float = 0.0
    marker_mm: float = 0.0
    dictionary: str = MARKERS
    legacy: bool = False

    def __post_init__(self):
        if self.kind not in KINDS:
            raise SettingError(
                f"target '{self.kind}' is not known; expected one of {', '.join(KINDS)}"
            )
        smallest = 2 if self.has_circles or self.kind == 'aprilgrid' else 3
        for name in ('rows', 'columns'):
            if not smallest <= getattr(self, name) <= _MAX_SIDE:
                raise SettingError(
                    f'{name} of the {self.kind} target is {getattr(self, name)}; '
                    f'expected {smallest} to {_MAX_SIDE}'
                )
        for name in ('dx_mm', 'dy_mm'):
            if not 0 < getattr(self, name) <= _MAX_SPACING_MM:
                raise SettingError(
                    f'{name} is {getattr(self, name):g}; '
                    f'expected more than 0, and {_MAX_SPACING_MM} mm at most'
                )
        if self.has_circles:
            self._check_size('radius_mm', self.radius_mm, self.gap_mm / _SMALLEST_GAP_RADII)
        if self.kind == 'charuco':
            self._check_size('marker_mm', self.marker_mm, 0.9 * min(self.dx_mm, self.dy_mm))
            self._check_markers(self.rows * self.columns // 2)
        if self.kind == 'aprilgrid':
            self._check_size('marker_mm', self.marker_mm, 0.95 * min(self.dx_mm, self.dy_mm))
            self._check_markers(self.rows * self.columns)
        if self.has_squares and self.dx_mm != self.dy_mm:
            raise SettingError(
                f'the squares of a {self.kind} target are {self.dx_mm:g} x {self.dy_mm:g} mm; '
                'expected dx_mm equal to dy_mm'
            )

    def _check_size(self, name, value, limit):
        if not 0 < value <= limit:
            raise SettingError(
                f'{name} is {value:g}; on this sheet expected more than 0 and {limit:g} mm at most'
            )

    def _check_markers(self, needed):
        if not can_read_markers():
            return  # other targets can be found all the same; looking for this one says so
        there = len(dictionary_named(self.dictionary).bytesList)
        if needed > there:
            raise SettingError(
                f'{self.kind} {self.rows} x {self.columns} needs {needed} markers, more than '
                f'the {there} markers of {self.dictionary}'
            )

    @property
    def has_circles(self) -> bool:
        """Whether the points are centres of circles, which lens and perspective deform."""
        return self.kind in ('circles', 'acircles')

    @property
    def has_squares(self) -> bool:
        """Whether the points are corners of squares, or of tags."""
        return not self.has_circles

    @property
    def has_markers(self) -> bool:
        """Whether a part of the sheet is enough, for its markers tell which part it is."""
        return self.kind in ('charuco', 'aprilgrid')

    @property
    def gap_mm(self) -> float:
        """Distance of the two nearest points."""
        if self.kind == 'acircles':
            return min(float(np.hypot(self.dx_mm, self.dy_mm)), 2 * self.dx_mm)
        if self.kind == 'aprilgrid':
            return min(self.dx_mm - self.marker_mm, self.marker_mm)
        return min(self.dx_mm, self.dy_mm)

    @property
    def steps(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Two steps, in units of (dx, dy), that lead from a circle to every other one."""
        return ((1, 1), (-1, 1)) if self.kind == 'acircles' else ((1, 0), (0, 1))

    @cached_property
    def cells(self) -> np.ndarray:
        """Column and row of each point in units of (dx, dy), (N, 2) int, row after row."""
        rows, columns = {
            'charuco': (self.rows - 1, self.columns - 1),
            'aprilgrid': (2 * self.rows, 2 * self.columns),
        }.get(self.kind, (self.rows, self.columns))
        row, column = np.mgrid[:rows, :columns].reshape(2, -1)
        if self.kind == 'acircles':
            column = 2 * column + row % 2
        return np.stack([column, row], axis=-1)

    @cached_property
    def points_mm(self) -> np.ndarray:
        """Points in the target's frame, (N, 3) float64."""
        if self.kind == 'aprilgrid':
            plane = self.cells // 2 * self.dx_mm + self.cells % 2 * self.marker_mm
            plane = plane - plane.max(axis=0) / 2
        else:
            plane = (self.cells - self.cells.max(axis=0) / 2) * (self.dx_mm, self.dy_mm)
        return np.concatenate([plane, np.zeros((len(plane), 1))], axis=-1)

    @property
    def dotted_squares(self) -> tuple[tuple[int, int], ...]:
        """Row and column of a chessboard's three squares with a dot, row after row.

        A white one by the middle, the one above it and the one to its right; OpenCV 4.6 finds no
        dots around a black one. They tell which part of the board a picture shows.
        """
        row, column = (self.rows + 1) // 2, (self.columns + 1) // 2
        column -= (row + column) % 2 == 0
        return (row - 1, column), (row, column), (row, column + 1)

    def name_of(self, point: int) -> str:
        """Return the row and column of a point, counted from 1 at the top left of the sheet."""
        column, row = self.cells[point]
        return f'row {row + 1}, column {column + 1}'

    def __str__(self):
        shape = f'{self.kind} {self.rows} x {self.columns} (rows x columns)'
        if self.kind == 'aprilgrid':
            return f'{shape}, tags {self.marker_mm:g} mm, {self.dx_mm:g} mm from tag to tag'
        if self.has_squares:
            markers = f', markers {self.marker_mm:g} mm' if self.has_markers else ''
            markers += f' of {self.dictionary}' if self.dictionary != MARKERS else ''
            markers += ', legacy layout' if self.legacy else ''
            return f'{shape}, squares {self.dx_mm:g} mm{markers}'
        return f'{shape}, dx {self.dx_mm:g} mm, dy {self.dy_mm:g} mm, radius {self.radius_mm:g} mm'


STANDARD = {
    # Al-Harasis and Sababha 2019, doi 10.1007/s11042-019-7501-z; the others fill A4 likewise.
    'circles': Target('circles', 3, 3, 100.0, 70.0, radius_mm=25.0),
    'acircles': Target('acircles', 11, 4, 20.0, 20.0, radius_mm=8.0),
    'chessboard': Target('chessboard', 6, 9, 25.0, 25.0),
    'charuco': Target('charuco', 5, 7, 35.0, 35.0, marker_mm=26.0),
    'aprilgrid': Target('aprilgrid', 6, 6, 28.6, 28.6, marker_mm=22.0, dictionary=TAGS),
}
"""The sheet of each kind where nothing else is said."""
