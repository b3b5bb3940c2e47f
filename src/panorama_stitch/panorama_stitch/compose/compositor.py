"""Composing: the cameras' pictures drawn straight into the panorama."""

from collections.abc import Collection, Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from fisheye_core.parallel import run_parallel
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.fade import Fade
from panorama_stitch.compose.gain import GainCompensation
from panorama_stitch.compose.layout import Layout, neighbours, pieces, wrapped
from panorama_stitch.compose.placed import Placed, PlacedView
from panorama_stitch.compose.view import Cut

_ALL_ROWS = slice(None)
_MOST_SLABS = 4
"""Rows are shared between so many threads at most: more would wait for Python's lock."""


class Compositor:
    """Draws panoramas of one layout; all that can be known before the pictures come is prepared.

    Each view is drawn into the columns that are its own, and with a neighbour into the columns of
    a seam, where the two are blended.

    Attributes
    ----------
    layout, gain
        What it was made from.
    views
        Of the cameras in the rig's order.
    blend
        What blends its seams.
    is_costly
        Whether economy leaves anything out.
    """

    def __init__(
        self,
        layout: Layout,
        placed: Placed,
        blend: str = 'feather',
        gain: GainCompensation | None = None,
    ):
        """Prepare.

        Parameters
        ----------
        layout, placed
            What to draw where; the tables of `placed` are not needed any more afterwards.
        blend
            How to blend seams that have a width, one of `BLENDS`.
        gain
            Keeps the views equally bright; None: they are drawn as they are.
        """
        self.layout = layout
        self.gain = gain
        self.views = tuple(p.view for p in sorted(placed.views, key=lambda view: view.index))
        self.blend = BLENDS[blend].kind
        self._fades = [
            Fade(layout, seam, pair, self.blend)
            for seam, pair in zip(layout.seams, neighbours(placed), strict=True)
        ]
        self.is_costly = any(fade.is_costly for fade in self._fades)
        count = min(cv2.getNumberOfCPUs(), _MOST_SLABS)
        edges = np.linspace(0, layout.surface.height, count + 1)
        slabs = [slice(*rows) for rows in pairwise(edges.round().astype(int))]
        self._parts: list[list[_Part]] = [[] for _ in slabs]
        run_parallel(
            [
                partial(self._prepare, placed, parts, rows)
                for parts, rows in zip(self._parts, slabs, strict=True)
            ]
        )

    def fits(self, images: Sequence[np.ndarray]) -> bool:
        """Whether images (height, width[, channels]) have the sizes that the views are for."""
        sizes = [(view.source.height, view.source.width) for view in self.views]
        return sizes == [image.shape[:2] for image in images]

    def compose(
        self,
        images: Sequence[np.ndarray],
        out: np.ndarray,
        *,
        stale: Collection[int] = (),
        economical: bool = False,
    ) -> None:
        """Draw a panorama.

        Parameters
        ----------
        images
            A picture of each camera, (height, width[, channels]) uint8.
        out
            (surface.height, surface.width[, channels]) uint8, overwritten.
        stale
            Indices of cameras whose pictures tell nothing of now: their brightness does not
            count, and where there are any, all only fade.
        economical
            Leave out what takes long in blends.

        Raises
        ------
        ImageFormatError
            If a picture has not the size that its view was made for.
        """
        gain = self.gain_for(out)
        self.expose(images, stale)
        for fade in self._fades:
            fade.expect(out)
        run_parallel([partial(self._draw, parts, images, out, gain) for parts in self._parts])
        for fade in self._fades:
            if not fade.is_local:
                fade.blend(_ALL_ROWS, out, economical=economical or bool(stale))

    def expose(self, images: Sequence[np.ndarray], stale: Collection[int] = ()) -> None:
        """Let the gain follow pictures, as `GainCompensation.update`; `compose` does it itself."""
        if gain := self.gain_for(images[0]):
            gain.update(images, stale)

    def gain_for(self, image: np.ndarray) -> GainCompensation | None:
        """Return what evens out the brightness of pictures with the channels of this one."""
        # Where grey pictures came in place of colour, a gain for them is still to be made.
        return self.gain if self.gain and self.gain.channels == image[0, 0].size else None

    def _prepare(self, placed: Placed, parts: list['_Part'], rows: slice) -> None:
        """Cut the tables of some rows: each view after its left neighbour, over which it fades."""
        fades = self._fades
        closing = fades[-1] if placed.wraps and fades else None
        for at, view in enumerate(placed.views):
            begin, end = self._columns(at, view)
            fade = fades[at - 1] if at else None
            if closing and not at:
                # The first view fades over the last one, which has to be drawn before.
                begin = closing.end - self.layout.surface.width
            parts += self._cut(view, rows, (begin, end), fade)
        if closing:
            begin, end = (edge - self.layout.surface.width for edge in closing.columns)
            parts += self._cut(placed.views[0], rows, (begin, end), closing)

    def _columns(self, at: int, view: PlacedView) -> tuple[int, int]:
        """Columns in which a view is drawn, those in which it fades among them."""
        begin, end = self.layout.drawn(view.index)
        if at:
            begin = self._fades[at - 1].begin
        if at < len(self._fades):
            end = self._fades[at].end
        return begin, end

    def _cut(
        self, view: PlacedView, rows: slice, columns: tuple[int, int], fade: Fade | None
    ) -> list['_Part']:
        """Parts of a view in some columns, cut where it ends and at the panorama's edges."""
        x, y = self.layout.origin
        parts = []
        for begin, end, is_seen in pieces(columns, (view.begin - x, view.end - x)):
            at = begin
            for first, last in wrapped(begin, end, self.layout.surface.width):
                source = slice(at + x, at + x + last - first)
                cut = view.cut(slice(rows.start + y, rows.stop + y), source) if is_seen else None
                parts.append(_Part(view.index, rows, slice(first, last), cut))
                at += last - first
        if parts and fade:
            parts[0] = parts[0]._replace(keep=fade)
            parts[-1] = parts[-1]._replace(blend=fade)
        return parts

    def _draw(self, parts: Sequence['_Part'], images: Sequence[np.ndarray], out, gain):
        for index, rows, columns, cut, keep, blend in parts:
            drawn = out[rows, columns]
            if keep:
                keep.keep(rows, out)
            if cut is None:
                drawn[:] = 0
            else:
                cut(images[index], drawn)
                if gain:
                    gain.apply(index, drawn)
            if blend and blend.is_local:
                blend.blend(rows, out)


class _Part(NamedTuple):
    """Where one thread draws how much of a view, and which seam it begins and ends there."""

    camera: int
    rows: slice
    columns: slice
    cut: Cut | None
    keep: Fade | None = None
    blend: Fade | None = None
