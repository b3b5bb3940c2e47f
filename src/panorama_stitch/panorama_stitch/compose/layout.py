"""Layout: which columns of the panorama are whose, and where one camera gives way to the next."""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import ceil, floor
from typing import NamedTuple

import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.compose.crop import CROPS, valid_rectangle
from panorama_stitch.compose.placed import Placed, PlacedView

__all__ = ['CROPS', 'Layout', 'Seam', 'covered', 'lay_out']

_NEARLY_MOST = 0.98
"""Columns in which both cameras show so much of the most are as good as the best one."""


class Seam(NamedTuple):
    """Columns of the panorama in which a view fades into its right neighbour.

    On a closed panorama they may go beyond its right edge, where its left one follows.
    """

    begin: int
    end: int


@dataclass(frozen=True)
class Layout:
    """The columns of all cameras.

    Attributes
    ----------
    surface
        What the panorama shows.
    order
        Indices of the cameras as they follow each other from left to right.
    seams
        One for each camera of `order` and the next one; the closing seam last.
    fields
        Columns [begin, end) of each camera, in the rig's order, in which it sees anything, shown
        or not; on a closed panorama they may go beyond its edges.
    wraps
        Whether the right edge of the panorama meets its left one.
    origin
        Column and row of the whole panorama, as it was placed, at which this one begins.
    """

    surface: Surface
    order: tuple[int, ...]
    seams: tuple[Seam, ...]
    fields: tuple[tuple[int, int], ...]
    wraps: bool = False
    origin: tuple[int, int] = (0, 0)

    def seam(self, one: int, other: int) -> Seam | None:
        """Return where a camera fades into the next; None for two that are no neighbours."""
        pairs = zip(self.order, (*self.order[1:], self.order[0]), strict=True)
        seams = dict(zip(pairs, self.seams, strict=False))
        return seams.get((one, other)) or seams.get((other, one))

    def drawn(self, index: int) -> tuple[int, int]:
        """Columns [begin, end) in which a camera is drawn, those of its seams among them.

        On a closed panorama `begin` may be negative.
        """
        at, last, width = self.order.index(index), len(self.order) - 1, self.surface.width
        if not self.wraps:
            begin = self.seams[at - 1].begin if at else 0
            return begin, self.seams[at].end if at < last else width
        if not self.seams:
            return 0, width
        return self.seams[at - 1].begin - (0 if at else width), self.seams[at].end

    def shown_columns(self, index: int) -> tuple[int, int]:
        """Columns of the picture in which a camera is drawn: the wider part if it is in two.

        Where others show all that it sees, `begin` is `end`.
        """
        begin, end = self.drawn(index)
        parts = wrapped(begin, end, self.surface.width)
        return max(parts, key=lambda part: part[1] - part[0], default=(begin, begin))


def wrapped(begin: int, end: int, width: int) -> list[tuple[int, int]]:
    """Cut columns that may lie beyond the edges of a closed panorama into those that are in it."""
    parts = []
    while begin < end:
        at = begin % width
        stop = min(end, begin + width - at)
        parts.append((at, at + stop - begin))
        begin = stop
    return parts


def lay_out(placed: Placed, *, fade_px: float, crop: str) -> Layout:
    """Divide the columns of a panorama between its cameras.

    Parameters
    ----------
    placed
        What each camera shows where.
    fade_px
        Width of the fade in the middle of an overlap; 0: one camera gives way to the next at
        once, where both show most.
    crop
        One of `CROPS`. 'valid': the panorama keeps the rows and columns that hold a picture
        everywhere; 'none': everything.
    """
    seams: list[Seam] = []
    for left, right, turn_px in neighbours(placed):
        seam = _seam(left, right, turn_px, fade_px)
        if seams:
            seam = Seam(*(max(edge, seams[-1].end) for edge in seam))
        seams.append(seam)
    order = tuple(view.index for view in placed.views)
    by_camera = sorted(placed.views, key=lambda view: view.index)
    fields = tuple((view.begin, view.end) for view in by_camera)
    layout = Layout(placed.surface, order, tuple(seams), fields, placed.wraps)
    return layout if crop == 'none' else _cropped(layout, placed)


def neighbours(placed: Placed) -> list[tuple[PlacedView, PlacedView, int]]:
    """Each view and the next, and how far the next one's columns have to be moved to be there."""
    pairs = [(left, right, 0) for left, right in pairwise(placed.views)]
    if placed.wraps and len(placed.views) > 1:
        pairs.append((placed.views[-1], placed.views[0], placed.surface.width))
    return pairs


def between(left: PlacedView, right: PlacedView, turn_px: int) -> tuple[int, int]:
    """Those of the columns that both may show that lie between their axes: a seam's place."""
    begin, end = shared(left, right, turn_px)
    return max(begin, ceil(left.axis)), min(end, floor(right.axis) + turn_px)


def shared(left: PlacedView, right: PlacedView, turn_px: int) -> tuple[int, int]:
    """Columns [begin, end) in which two neighbours may both show something; of the left one."""
    return max(left.begin, right.begin + turn_px), min(left.end, right.end + turn_px)


def _seam(left: PlacedView, right: PlacedView, turn_px: int, fade_px: float) -> Seam:
    """Put the fade where both views show most, as near to the middle as that is."""
    begin, end = shared(left, right, turn_px)
    if fade_px:
        begin, end = between(left, right, turn_px)
    if begin >= end:
        return Seam(right.begin + turn_px, right.begin + turn_px)
    both = left.valid[:, begin - left.begin : end - left.begin]
    both = both & right.valid[:, begin - turn_px - right.begin : end - turn_px - right.begin]
    most = both.sum(axis=0)
    good = np.flatnonzero(most >= _NEARLY_MOST * most.max())
    if not fade_px:
        return Seam(begin + int(good[0]), begin + int(good[0]))
    middle, half = (begin + end) / 2, min(fade_px, end - begin) / 2
    center = begin + good[np.abs(good + 0.5 + begin - middle).argmin()] + 0.5
    if abs(center - middle) < 1:
        center = middle
    center = min(max(center, begin + half), end - half)
    return Seam(round(center - half), round(center + half))


def _cropped(layout: Layout, placed: Placed) -> Layout:
    x, y, width, height = valid_rectangle(
        covered(layout, placed), layout.surface, wraps=layout.wraps
    )
    surface = layout.surface.window(x, y, width, height)
    if layout.wraps:
        return replace(layout, surface=surface, origin=(x, y))

    def inside(columns: tuple[int, int]) -> Seam:
        return Seam(*(min(max(edge - x, 0), width) for edge in columns))

    seams, fields = (tuple(map(inside, each)) for each in (layout.seams, layout.fields))
    return replace(layout, surface=surface, seams=seams, fields=fields, origin=(x, y))


def covered(layout: Layout, placed: Placed) -> np.ndarray:
    """(height, width) bool: where the panorama shows something."""
    surface, (x, y) = layout.surface, layout.origin
    result = np.zeros((surface.height, surface.width), bool)
    rows = slice(y, y + surface.height)
    for view in placed.views:
        begin, end = visible(layout, view)
        shows = view.shows(rows, slice(begin + x, max(begin, end) + x))
        at = 0
        for first, last in wrapped(begin, end, surface.width):
            result[:, first:last] |= shows[:, at : at + last - first]
            at += last - first
    return result


def visible(layout: Layout, view: PlacedView) -> tuple[int, int]:
    """Columns [begin, end) in which a view is drawn and may show something."""
    (begin, end), x = layout.drawn(view.index), layout.origin[0]
    return max(begin, view.begin - x), min(end, view.end - x)


def pieces(columns: tuple[int, int], seen: tuple[int, int]) -> list[tuple[int, int, bool]]:
    """Cut columns into those before, in and after some others, and tell which are in them."""
    begin, end = columns
    edges = [begin, *(min(max(edge, begin), end) for edge in seen), end]
    cuts = zip(pairwise(edges), (False, True, False), strict=True)
    return [(first, last, is_in) for (first, last), is_in in cuts if last > first]
