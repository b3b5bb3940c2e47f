"""Composing: the cameras' pictures drawn straight into the panorama."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import cv2
import numpy as np

from panorama_stitch.compose.blend import Blend, Feather, Multiband
from panorama_stitch.compose.gain import GainCompensation
from panorama_stitch.compose.layout import Layout, Seam
from panorama_stitch.compose.parallel import share
from panorama_stitch.compose.view import Cut, View

_BLENDS = {'feather': Feather, 'multiband': Multiband}
BLENDS = {'none': 0.0, 'feather': 1.0, 'multiband': 4.0}
"""The ways to blend, and the width of the strip that each needs in units of `feather_deg`."""
_ALL_ROWS = slice(None)
_MOST_SLABS = 4
"""Rows are shared between so many threads at most: more would wait for Python's lock."""


class Compositor:
    """Draws panoramas of one layout; all that can be known before the pictures come is prepared.

    Each view is drawn into the columns that are its own, and with a neighbour into the columns of
    a seam, where the two are blended.

    Attributes
    ----------
    layout, views, gain
        What it was made from.
    """

    def __init__(
        self,
        layout: Layout,
        views: Sequence[View],
        blend: str = 'feather',
        gain: GainCompensation | None = None,
    ):
        """Prepare.

        Parameters
        ----------
        layout, views
            What to draw where.
        blend
            How to blend seams that have a width, one of `BLENDS`.
        gain
            Keeps the views equally bright; None: they are drawn as they are.
        """
        self.layout = layout
        self.views = tuple(views)
        self.gain = gain
        self._fades = [_Fade(i, layout, views, blend) for i in range(len(layout.seams))]
        count = min(cv2.getNumberOfCPUs(), _MOST_SLABS)
        edges = np.linspace(0, layout.surface.height, count + 1)
        slabs = [slice(*rows) for rows in pairwise(edges.round().astype(int))]
        self._parts: list[list[_Part]] = [[] for _ in slabs]
        share(
            [
                partial(self._prepare, parts, rows)
                for parts, rows in zip(self._parts, slabs, strict=True)
            ]
        )

    def compose(
        self, images: Sequence[np.ndarray], out: np.ndarray, *, are_live: bool = True
    ) -> None:
        """Draw a panorama.

        Parameters
        ----------
        images
            A picture of each camera, (height, width[, channels]) uint8.
        out
            (surface.height, surface.width[, channels]) uint8, overwritten.
        are_live
            Whether the brightness of the pictures tells anything of the cameras now.

        Raises
        ------
        ImageFormatError
            If a picture has not the size that its view was made for.
        """
        # Where grey pictures came in place of colour, a gain for them is still to be made.
        gain = self.gain if self.gain and self.gain.channels == out[0, 0].size else None
        if gain and are_live:
            gain.update(images)
        for fade in self._fades:
            fade.expect(out)
        share([partial(self._draw, parts, images, out, gain) for parts in self._parts])
        for fade in self._fades:
            if not fade.is_local:
                fade.blend(_ALL_ROWS, out)

    def _prepare(self, parts: list['_Part'], rows: slice) -> None:
        for index, (view, origin) in enumerate(zip(self.views, self.layout.origins, strict=True)):
            begin, end = self.layout.drawn(index)
            if end > begin:
                size = end - begin, rows.stop - rows.start
                cut = view.cut(begin - origin.x_px, rows.start - origin.y_px, *size)
                parts.append(_Part(index, rows, slice(begin, end), cut))

    def _draw(self, parts: Sequence['_Part'], images: Sequence[np.ndarray], out, gain):
        for index, rows, columns, cut in parts:
            drawn = out[rows, columns]
            if index:
                self._fades[index - 1].keep(rows, out)
            cut(images[index], drawn)
            if gain:
                gain.apply(index, drawn)
            if index and self._fades[index - 1].is_local:
                self._fades[index - 1].blend(rows, out)


class _Part(NamedTuple):
    """Where one thread draws how much of a view."""

    index: int
    rows: slice
    columns: slice
    cut: Cut


class _Fade:
    """The seam between two views: the right one is drawn over the left one, which is kept."""

    def __init__(self, index: int, layout: Layout, views: Sequence[View], blend: str):
        seam = layout.seams[index]
        self._columns = slice(*seam)
        self._left = np.empty(0, np.uint8)
        self._blend: Blend | None = None
        if seam.end > seam.begin:
            seen = [_seen(views[i], layout, i, seam) for i in (index, index + 1)]
            self._blend = _BLENDS[blend](*seen)

    def expect(self, out: np.ndarray) -> None:
        """Make room for the left view of a panorama."""
        shape = out[:, self._columns].shape
        if self._left.shape != shape:
            self._left = np.empty(shape, np.uint8)

    def keep(self, rows: slice, out: np.ndarray) -> None:
        """Keep some rows of the left view before the right one is drawn."""
        self._left[rows] = out[rows, self._columns]

    @property
    def is_local(self) -> bool:
        """Whether some rows can be blended while others are not drawn yet."""
        return self._blend is not None and self._blend.is_local

    def blend(self, rows: slice, out: np.ndarray) -> None:
        """Blend some rows of the views."""
        if self._blend:
            self._blend(self._left[rows], out[rows, self._columns], rows)


def _seen(view: View, layout: Layout, index: int, seam: Seam) -> np.ndarray:
    """(height, seam's width) bool: where a view shows anything in a seam."""
    origin, height = layout.origins[index], layout.surface.height
    width = seam.end - seam.begin
    cut = view.cut(seam.begin - origin.x_px, -origin.y_px, width, height)
    return view.shown(cut, (height, width))
