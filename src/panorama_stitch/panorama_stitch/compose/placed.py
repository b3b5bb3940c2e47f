"""Views that have their place: where on the surface around a rig each camera shows anything."""

from dataclasses import dataclass, field

import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.compose.view import Cut, View


@dataclass(eq=False)
class PlacedView:
    """A view on the surface of the whole panorama, all rows of it.

    Attributes
    ----------
    view
        What is drawn.
    index
        Which camera of the rig it is.
    axis
        Column in which the camera looks along its axis.
    begin, end
        Columns that may show anything; on a closed surface they may go beyond its edges.
    valid
        (rows, end - begin) bool: where it shows anything.
    body
        Likewise: where that is the robot itself; None for nowhere.
    """

    view: View
    index: int
    axis: float
    begin: int
    end: int
    valid: np.ndarray = field(init=False)
    body: np.ndarray | None = field(init=False, default=None)

    def prepare(self, surface: Surface) -> None:
        """Compute what is drawn where on the surface of the panorama."""
        width = max(1, self.end - self.begin)
        self._table = self.view.drawn_on(surface.window(self.begin, 0, width, surface.height))
        self.valid, body = self.view.shows(self._table), self.view.shows_body(self._table)
        if body is not None:
            self.body = body & self.valid

    def cut(self, rows: slice, columns: slice) -> Cut:
        """Prepare to draw a part, in rows and columns of the whole panorama."""
        return self._table.part(rows, self._own(columns))

    def shows(self, rows: slice, columns: slice) -> np.ndarray:
        """(rows, columns) bool: where a part shows anything."""
        return self.valid[rows, self._own(columns)]

    def shows_body(self, rows: slice, columns: slice) -> np.ndarray:
        """(rows, columns) bool: where a part shows the robot itself."""
        if self.body is None:
            return np.zeros((rows.stop - rows.start, columns.stop - columns.start), bool)
        return self.body[rows, self._own(columns)]

    def samples(self, surface: Surface, columns: tuple[int, int], step: float):
        """Prepare to draw every `step`-th row and column of some columns of a surface."""
        begin, end = columns
        window = surface.window(begin, 0, max(1, end - begin), surface.height)
        return self.view.drawn_on(window.with_focal(window.focal_px / step))

    def _own(self, columns: slice) -> slice:
        return slice(columns.start - self.begin, columns.stop - self.begin)


@dataclass(frozen=True, eq=False)
class Placed:
    """All views of a rig.

    Attributes
    ----------
    surface
        What the whole panorama shows, before it is cropped.
    views
        From left to right.
    wraps
        Whether its right edge meets its left one.
    """

    surface: Surface
    views: tuple[PlacedView, ...]
    wraps: bool
