"""Gain compensation: cameras that expose differently made equally bright where they meet.

After M. Brown, D. G. Lowe, "Automatic panoramic image stitching using invariant features", 2007,
https://doi.org/10.1007/s11263-006-0002-3, section 6; but one camera is left as it is, which saves
its share of the work.
"""

from collections import deque
from collections.abc import Sequence
from math import sqrt

import cv2
import numpy as np

from panorama_stitch.compose.layout import Layout
from panorama_stitch.compose.view import View

_AROUND_SEAM_DEG = 12.0
"""Width of the overlap in which brightness is compared."""
_SAMPLES, _FEWEST_SAMPLES = 1500, 50
_DARK, _BRIGHT, _CLIPPED = 16, 245, 254
"""Grey levels: noise falsifies what is darker, clipping what is brighter; clipped for sure."""
_CLIPPED_SHARE = 0.02
"""Of the samples, from which on white has to stay white."""
_ALIKE = 1.1
"""Samples that differ by a larger factor, once evened out, show different things."""
_EVERY = 8
"""Panoramas from one comparison to the next."""
_MEDIAN_OF = 3
_SMOOTHING = 0.25
"""Share of the way to the median of the last comparisons that a factor goes at once."""
_SMALLEST_CHANGE, _SMALLEST_TINT = 0.002, 0.01
"""Factors that differ less from 1 are not worth the time; and from each other."""
_LARGEST_FACTOR = 4.0
_ROWS = 64
"""Rows that are multiplied at once by factors that differ between channels."""


class GainCompensation:
    """Measures how bright neighbours are where they overlap, and evens it out.

    What moves, what one camera shows alone and what is clipped does not count. The factors follow
    the comparisons so slowly that nothing flickers.

    Attributes
    ----------
    channels : int
        Of the pictures that it is for.
    """

    def __init__(self, layout: Layout, views: Sequence[View], group: Sequence[np.ndarray]):
        """Prepare, and compare a group of pictures (height, width[, channels]), one a camera."""
        self.channels = channels = 1 if group[0].ndim == 2 else group[0].shape[2]
        self._pairs = [_Pair(layout, views, i, channels) for i in range(len(layout.seams))]
        widths = [end - begin for begin, end in map(layout.drawn, range(len(views)))]
        self._multipliers = [_Multiplier(width, channels) for width in widths]
        self._age = 0
        for pair in self._pairs:
            pair.compare(group)
        # Where nothing is clipped the brighter pictures are darkened, so that nothing will be.
        # Where the sky is, darkened white would be grey, and a change of colour would tint it.
        is_clipped = any(pair.clipped > _CLIPPED_SHARE for pair in self._pairs)
        self._in_color = not is_clipped
        needed = self._needed().mean(axis=1)
        self._reference = int(needed.argmin() if is_clipped else needed.argmax())
        self._use_needed()

    @property
    def factors(self) -> np.ndarray:
        """(cameras, channels): what the pictures of each camera are multiplied by."""
        factors = self._needed()
        factors = np.exp(factors - factors[self._reference])
        return factors.clip(1 / _LARGEST_FACTOR, _LARGEST_FACTOR)

    def update(self, images: Sequence[np.ndarray]) -> None:
        """Follow the pictures, one of each camera, that are about to be drawn."""
        self._age = (self._age + 1) % _EVERY
        if not self._age:
            for pair in self._pairs:
                pair.compare(images)
            self._use_needed()

    def apply(self, index: int, drawn: np.ndarray) -> None:
        """Multiply rows of the panorama in which camera `index` is drawn by its factors."""
        self._multipliers[index](drawn)

    def _needed(self) -> np.ndarray:
        """(cameras, channels) logarithms of factors that make all as bright as the first."""
        ratios = np.stack([pair.log_ratio for pair in self._pairs])
        if not self._in_color:
            ratios = np.broadcast_to(ratios.mean(axis=1, keepdims=True), ratios.shape)
        return np.concatenate([np.zeros((1, ratios.shape[1])), np.cumsum(ratios, axis=0)])

    def _use_needed(self) -> None:
        for multiplier, factors in zip(self._multipliers, self.factors, strict=True):
            multiplier.set(factors)


class _Pair:
    """Compares two neighbours.

    Attributes
    ----------
    log_ratio : ndarray
        (channels,) logarithm of what the right one has to be multiplied by; 0 until it is known.
    clipped : float
        Share of the samples that were clipped in one of the views last time.
    """

    def __init__(self, layout: Layout, views: Sequence[View], index: int, channels: int):
        surface, seam = layout.surface, layout.seams[index]
        left, right = layout.origins[index : index + 2]
        middle, half = sum(seam) / 2, np.radians(_AROUND_SEAM_DEG / 2) * surface.focal_px
        begin = max(right.x_px, middle - half)
        end = min(left.x_px + views[index].surface.width, middle + half)
        self.clipped = 0.0
        self.log_ratio = np.zeros(channels)
        self._history: deque[np.ndarray] = deque(maxlen=_MEDIAN_OF)
        self._index = index
        width, height = max(1, round(end - begin)), surface.height
        step = max(1.0, sqrt(width * height / _SAMPLES))
        self._samples = [
            view.samples(begin - origin.x_px, -origin.y_px, width, height, step)
            for view, origin in ((views[index], left), (views[index + 1], right))
        ]
        seen = [
            view.shown(samples, samples.valid.shape)
            for view, samples in zip(views[index : index + 2], self._samples, strict=True)
        ]
        self._seen = (seen[0] & seen[1]).ravel() & (end > begin)

    def compare(self, images: Sequence[np.ndarray]) -> None:
        """Learn from pictures, one of each camera."""
        ratio = self._ratio(*(self._planes(i, images[self._index + i]) for i in (0, 1)))
        if ratio is None:
            return
        self._history.append(np.log(ratio))
        aim = np.sort(self._history, axis=0)[len(self._history) // 2]
        is_first = len(self._history) == 1
        self.log_ratio = aim if is_first else self.log_ratio + _SMOOTHING * (aim - self.log_ratio)

    def _planes(self, which: int, image: np.ndarray) -> np.ndarray:
        """(channels, samples) uint8 of one of the two views."""
        drawn = self._samples[which](image)
        return np.ascontiguousarray(drawn.reshape(len(self._seen), -1).T)

    def _ratio(self, left: np.ndarray, right: np.ndarray) -> np.ndarray | None:
        """Left over right (channels,) where both show the same, None if hardly any sample does."""
        brightest = np.maximum(left, right).max(axis=0)
        darkest = np.minimum(left, right).min(axis=0)
        usable = self._seen & (brightest < _BRIGHT) & (darkest > _DARK)
        clipped = np.count_nonzero(self._seen & (brightest >= _CLIPPED))
        self.clipped = clipped / max(1, np.count_nonzero(self._seen))
        if np.count_nonzero(usable) < _FEWEST_SAMPLES:
            return None
        left, right = left.astype(np.float32), right.astype(np.float32)
        ratios = left.sum(axis=0) / np.maximum(right.sum(axis=0), 1)
        shown = ratios[usable]
        median = np.partition(shown, len(shown) // 2)[len(shown) // 2]
        alike = usable & (ratios < median * _ALIKE) & (ratios > median / _ALIKE)
        return (left @ alike) / (right @ alike)


class _Multiplier:
    """Multiplies drawn rows; faster where all channels have the same factor."""

    def __init__(self, width: int, channels: int):
        self._weights = np.full((_ROWS, width, channels), 255, np.uint8)
        self._scale = 1.0
        self._is_grey = True

    def set(self, factors: np.ndarray) -> None:
        """Use other factors (channels,)."""
        self._is_grey = factors.max() <= factors.min() * (1 + _SMALLEST_TINT)
        self._scale = float(factors.mean() if self._is_grey else factors.max())
        if not self._is_grey:
            self._weights[:] = np.rint(255 * factors / factors.max())

    def __call__(self, drawn: np.ndarray) -> None:
        if not self._is_grey:
            for top in range(0, len(drawn), _ROWS):
                part = drawn[top : top + _ROWS]
                cv2.multiply(part, self._weights[: len(part)], dst=part, scale=self._scale / 255)
        elif abs(self._scale - 1) > _SMALLEST_CHANGE:
            cv2.convertScaleAbs(drawn, dst=drawn, alpha=self._scale)
