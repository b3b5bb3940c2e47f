"""Brightness: how much brighter one of two neighbours is where both show the same."""

from collections import deque
from collections.abc import Sequence
from math import sqrt

import numpy as np

from panorama_stitch.compose.layout import Layout, shared
from panorama_stitch.compose.placed import PlacedView

_AROUND_SEAM_DEG = 12.0
"""Width of the overlap in which brightness is compared."""
_SAMPLES, _FEWEST_SAMPLES = 1500, 50
_DARK, _BRIGHT, _CLIPPED = 16, 245, 254
"""Grey levels: noise falsifies what is darker, clipping what is brighter; clipped for sure."""
_ALIKE = 1.1
"""Samples that differ by a larger factor, once evened out, show different things."""
_MEDIAN_OF = 3
_SMOOTHING = 0.25
"""Share of the way to the median of the last comparisons that a factor goes at once."""


class BrightnessRatio:
    """Follows how bright the right one of two neighbours is beside the left one.

    Attributes
    ----------
    cameras : tuple of int
        Indices of the left and the right one.
    log_ratio : ndarray
        (channels,) logarithm of what the right one has to be multiplied by; 0 until it is known.
    clipped : float
        Share of the samples that were clipped in one of the views last time.
    """

    def __init__(
        self,
        layout: Layout,
        middle: float,
        pair: tuple[PlacedView, PlacedView, int],
        channels: int,
    ):
        left, right, turn_px = pair
        surface, x = layout.surface, layout.origin[0]
        half = np.radians(_AROUND_SEAM_DEG / 2) * surface.focal_px
        begin, end = (edge - x for edge in shared(left, right, turn_px))
        begin, end = round(max(begin, middle - half)), round(min(end, middle + half))
        self.clipped = 0.0
        self.log_ratio = np.zeros(channels)
        self.cameras = left.index, right.index
        self._history: deque[np.ndarray] = deque(maxlen=_MEDIAN_OF)
        step = max(1.0, sqrt(max(1, end - begin) * surface.height / _SAMPLES))
        self._samples = [
            view.samples(surface, (begin - moved, end - moved), step)
            for view, moved in ((left, 0), (right, turn_px))
        ]
        self._seen = np.full(self._samples[0].valid.size, end > begin)
        for view, samples in zip((left, right), self._samples, strict=True):
            self._seen &= view.view.shows_scene(samples).ravel()

    @property
    def is_known(self) -> bool:
        """Whether the pair was compared at all."""
        return bool(self._history)

    def compare(self, images: Sequence[np.ndarray]) -> None:
        """Learn from pictures, one of each camera."""
        ratio = self._ratio(
            *(self._planes(i, images[camera]) for i, camera in enumerate(self.cameras))
        )
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
