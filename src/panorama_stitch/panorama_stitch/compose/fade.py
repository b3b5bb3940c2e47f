"""Fades: the columns in which two views are drawn, one over the other, and then blended."""

from collections.abc import Callable

import numpy as np

from panorama_stitch.compose.blend import Blend
from panorama_stitch.compose.layout import Layout, Seam, shared, wrapped
from panorama_stitch.compose.placing import PlacedView


class Fade:
    """The seam between two views: the right one is drawn over the left one, which is kept.

    Attributes
    ----------
    begin, end
        Columns that both views draw: those of the seam, and where one of them shows the robot
        itself, those in which the other can stand in.
    """

    def __init__(
        self,
        layout: Layout,
        seam: Seam,
        pair: tuple[PlacedView, PlacedView, int],
        blend: Callable[..., Blend],
    ):
        self.begin, self.end = _strip(layout, seam, pair)
        self._pieces = _pieces(self.begin, self.end, layout.surface.width)
        self._left = np.empty(0, np.uint8)
        self._right = np.empty(0, np.uint8)
        self._blend: Blend | None = None
        if self.end > self.begin:
            seen = _seen(layout, (self.begin, self.end), pair)
            self._blend = blend(*seen, (seam.begin - self.begin, seam.end - self.begin))

    @property
    def columns(self) -> tuple[int, int]:
        """Begin and end."""
        return self.begin, self.end

    def expect(self, out: np.ndarray) -> None:
        """Make room for the views of a panorama."""
        shape = (len(out), self.end - self.begin, *out.shape[2:])
        if self._left.shape != shape:
            self._left = np.empty(shape, np.uint8)
            if len(self._pieces) > 1:
                self._right = np.empty(shape, np.uint8)

    def keep(self, rows: slice, out: np.ndarray) -> None:
        """Keep some rows of the left view before the right one is drawn."""
        for there, here in self._pieces:
            self._left[rows, here] = out[rows, there]

    @property
    def is_local(self) -> bool:
        """Whether some rows can be blended while others are not drawn yet."""
        return self._blend is not None and self._blend.is_local

    def blend(self, rows: slice, out: np.ndarray) -> None:
        """Blend some rows of the views."""
        if not self._blend:
            return
        if len(self._pieces) == 1:
            self._blend(self._left[rows], out[rows, self._pieces[0][0]], rows)
            return
        # A seam across the panorama's edge is blended in one piece.
        for there, here in self._pieces:
            self._right[rows, here] = out[rows, there]
        self._blend(self._left[rows], self._right[rows], rows)
        for there, here in self._pieces:
            out[rows, there] = self._right[rows, here]


def _pieces(begin: int, end: int, width: int) -> list[tuple[slice, slice]]:
    """Columns of the panorama, and which of the strip's they are."""
    pieces, at = [], 0
    for first, last in wrapped(begin, end, width):
        pieces.append((slice(first, last), slice(at, at + last - first)))
        at += last - first
    return pieces


def _strip(layout: Layout, seam: Seam, pair) -> tuple[int, int]:
    """Columns in which both views are needed."""
    left, right, turn_px = pair
    if left.body is None and right.body is None:
        return seam
    x = layout.origin[0]
    begin, end = (edge - x for edge in shared(left, right, turn_px))
    if not layout.wraps:
        begin, end = max(begin, 0), min(end, layout.surface.width)
    # Other seams keep their columns.
    at = layout.seams.index(seam)
    if at or layout.wraps:
        around = 0 if at else layout.surface.width
        begin = max(begin, layout.seams[at - 1].end - around)
    if at + 1 < len(layout.seams) or layout.wraps:
        following = (at + 1) % len(layout.seams)
        around = 0 if following else layout.surface.width
        end = min(end, layout.seams[following].begin + around)
    if end <= begin:
        return seam
    height = layout.surface.height
    rows = slice(layout.origin[1], layout.origin[1] + height)
    hidden = left.shows_body(rows, slice(begin + x, end + x)).any(axis=0)
    hidden |= right.shows_body(rows, slice(begin + x - turn_px, end + x - turn_px)).any(axis=0)
    columns = begin + np.flatnonzero(hidden)
    if not len(columns):
        return seam
    return min(seam.begin, int(columns[0])), max(seam.end, int(columns[-1]) + 1)


def _seen(layout: Layout, strip: tuple[int, int], pair) -> list[np.ndarray]:
    """(height, strip's width) bool for each of two views: where it is to be shown."""
    (begin, end), (x, y) = strip, layout.origin
    rows = slice(y, y + layout.surface.height)
    seen, body = [], []
    for view, moved in ((pair[0], 0), (pair[1], pair[2])):
        columns = slice(begin + x - moved, end + x - moved)
        seen.append(_within(view, rows, columns, view.shows))
        body.append(_within(view, rows, columns, view.shows_body))
    # The robot itself is hidden where the other view shows what is behind it.
    hidden = [body[i] & seen[1 - i] & ~body[1 - i] for i in (0, 1)]
    return [mine & ~covered for mine, covered in zip(seen, hidden, strict=True)]


def _within(view: PlacedView, rows: slice, columns: slice, shows) -> np.ndarray:
    """What `shows` says of columns, False beyond those of the view."""
    result = np.zeros((rows.stop - rows.start, columns.stop - columns.start), bool)
    begin, end = max(columns.start, view.begin), min(columns.stop, view.end)
    if end > begin:
        part = shows(rows, slice(begin, end))
        result[:, begin - columns.start : end - columns.start] = part
    return result
