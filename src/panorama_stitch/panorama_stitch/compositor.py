"""Composing: the cameras' pictures drawn straight into the panorama."""

from collections.abc import Sequence

import cv2
import numpy as np

from panorama_stitch.layout import Layout
from panorama_stitch.view import View

BLENDS = ('none', 'feather')


class Compositor:
    """Draws panoramas of one layout; all that can be known before the pictures come is prepared.

    Each view is drawn into the columns that are its own; only in a seam are two views drawn, and
    blended with weights that are 0 where a view shows nothing.
    """

    def __init__(self, layout: Layout, views: Sequence[View]):
        self.layout = layout
        height = layout.surface.height
        self._own = []
        for index, (view, origin) in enumerate(zip(views, layout.origins, strict=True)):
            begin, end = layout.columns(index)
            if end > begin:
                cut = view.cut(begin - origin.x_px, -origin.y_px, end - begin, height)
                self._own.append((index, slice(begin, end), cut))
        self._fades = [
            _Fade(index, layout, views)
            for index, seam in enumerate(layout.seams)
            if seam.end > seam.begin
        ]

    def compose(self, images: Sequence[np.ndarray], out: np.ndarray) -> None:
        """Draw a panorama.

        Parameters
        ----------
        images
            A picture of each camera, (height, width[, channels]) uint8.
        out
            (surface.height, surface.width[, channels]) uint8, overwritten.

        Raises
        ------
        ImageFormatError
            If a picture has not the size that its view was made for.
        """
        for index, columns, cut in self._own:
            cut(images[index], out[:, columns])
        for fade in self._fades:
            fade.draw(images, out)


class _Fade:
    """The seam between two views: both drawn, then blended."""

    def __init__(self, index: int, layout: Layout, views: Sequence[View]):
        self._index = index
        begin, end = layout.seams[index]
        self._columns = slice(begin, end)
        shape = layout.surface.height, end - begin
        ramp = (np.arange(end - begin, dtype=np.float32) + 0.5) / (end - begin)
        weights = []
        self._cuts = []
        for which, weight in ((index, 1 - ramp), (index + 1, ramp)):
            view, origin = views[which], layout.origins[which]
            cut = view.cut(begin - origin.x_px, -origin.y_px, shape[1], shape[0])
            self._cuts.append(cut)
            weights.append(weight * _seen(view, cut, shape))
        # Rows in which no view shows anything stay black with any weights.
        total = np.maximum(weights[0] + weights[1], np.finfo(np.float32).tiny)
        self._weights = [np.ascontiguousarray(weight / total) for weight in weights]
        self._drawn = None

    def draw(self, images: Sequence[np.ndarray], out: np.ndarray) -> None:
        strip = out[:, self._columns]
        if self._drawn is None or self._drawn[0].shape != strip.shape:
            self._drawn = [np.empty(strip.shape, np.uint8) for _ in range(2)]
        for drawn, cut, image in zip(self._drawn, self._cuts, images[self._index :], strict=False):
            cut(image, drawn)
        cv2.blendLinear(*self._drawn, *self._weights, dst=strip)


def _seen(view: View, cut, shape) -> np.ndarray:
    """(height, width) float32, 1 where the cut shows anything."""
    source = (view.source.height, view.source.width)
    seen = np.ones(source, np.uint8) if view.seen is None else view.seen.astype(np.uint8)
    drawn = np.empty(shape, np.uint8)
    cut(seen * 255, drawn)
    return (drawn == 255).astype(np.float32)
