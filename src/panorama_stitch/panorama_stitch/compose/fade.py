"""Fades: the columns in which two views are drawn, one over the other, and then blended."""

import numpy as np

from panorama_stitch.compose.blend import Blend, BlendKind
from panorama_stitch.compose.layout import Layout, Seam, shared, wrapped
from panorama_stitch.compose.placed import PlacedView

_MOST_OVERLAP_RAD = np.radians(40.0)
"""Columns beside a seam that a blend may ask for: more cost time and gain little."""


class Fade:
    """The seam between two views: the right one is drawn over the left one, which is kept.

    Attributes
    ----------
    begin, end
        Columns that both views draw: those of the seam, those beside it that the blend needs, and
        where one of them shows the robot itself, those in which the other can stand in.
    """

    def __init__(
        self,
        layout: Layout,
        seam: Seam,
        pair: tuple[PlacedView, PlacedView, int],
        blend: BlendKind,
    ):
        self.begin, self.end = _strip(layout, seam, pair, blend.needs_overlap)
        self._pieces = _pieces(self.begin, self.end, layout.surface.width)
        self._left = np.empty(0, np.uint8)
        self._right = np.empty(0, np.uint8)
        self._blend: Blend | None = None
        if self.end > self.begin:
            left, right = _seen(layout, (self.begin, self.end), pair)
            self._blend = blend(left, right, (seam.begin - self.begin, seam.end - self.begin))

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

    @property
    def is_costly(self) -> bool:
        """Whether economy leaves anything out."""
        return self._blend is not None and self._blend.needs_overlap

    def blend(self, rows: slice, out: np.ndarray, *, economical: bool = False) -> None:
        """Blend some rows of the views, without what takes long if `economical`."""
        if not self._blend:
            return
        if len(self._pieces) == 1:
            right = out[rows, self._pieces[0][0]]
            self._blend(self._left[rows], right, rows, economical=economical)
            return
        # A seam across the panorama's edge is blended in one piece.
        for there, here in self._pieces:
            self._right[rows, here] = out[rows, there]
        self._blend(self._left[rows], self._right[rows], rows, economical=economical)
        for there, here in self._pieces:
            out[rows, there] = self._right[rows, here]


def _pieces(begin: int, end: int, width: int) -> list[tuple[slice, slice]]:
    """Columns of the panorama, and which of the strip's they are."""
    pieces, at = [], 0
    for first, last in wrapped(begin, end, width):
        pieces.append((slice(first, last), slice(at, at + last - first)))
        at += last - first
    return pieces


def _strip(layout: Layout, seam: Seam, pair, needs_overlap: bool) -> tuple[int, int]:
    """Columns in which both views are needed."""
    left, right, _ = pair
    if left.body is None and right.body is None and not needs_overlap:
        return seam
    begin, end = _room(layout, seam, pair, is_shared=needs_overlap)
    if end <= begin:
        return seam
    columns = _hidden(layout, (begin, end), pair)
    if needs_overlap:
        most = round(_MOST_OVERLAP_RAD * layout.surface.focal_px / 2)
        columns = [*columns, max(begin, seam.begin - most), min(end, seam.end + most) - 1]
    return min([seam.begin, *columns]), max([seam.end, *(column + 1 for column in columns)])


def _room(layout: Layout, seam: Seam, pair, *, is_shared: bool) -> tuple[int, int]:
    """Columns that both views show and no other seam needs; shared with them half and half."""
    x, width = layout.origin[0], layout.surface.width
    begin, end = (edge - x for edge in shared(*pair))
    if not layout.wraps:
        begin, end = max(begin, 0), min(end, width)
    at = layout.seams.index(seam)
    if at or layout.wraps:
        edge = layout.seams[at - 1].end - (0 if at else width)
        begin = max(begin, (edge + seam.begin) // 2 if is_shared else edge)
    if at + 1 < len(layout.seams) or layout.wraps:
        following = (at + 1) % len(layout.seams)
        edge = layout.seams[following].begin + (0 if following else width)
        end = min(end, (edge + seam.end) // 2 if is_shared else edge)
    return begin, end


def _hidden(layout: Layout, columns: tuple[int, int], pair) -> list[int]:
    """Those columns in which a view shows the robot itself."""
    (left, right, turn_px), (x, y) = pair, layout.origin
    begin, end = (edge + x for edge in columns)
    rows = slice(y, y + layout.surface.height)
    hidden = left.shows_body(rows, slice(begin, end)).any(axis=0)
    hidden |= right.shows_body(rows, slice(begin - turn_px, end - turn_px)).any(axis=0)
    return [columns[0] + int(column) for column in np.flatnonzero(hidden)]


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
