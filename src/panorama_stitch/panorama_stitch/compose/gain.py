"""Gain compensation: cameras that expose differently made equally bright where they meet.

After M. Brown, D. G. Lowe, "Automatic panoramic image stitching using invariant features", 2007,
https://doi.org/10.1007/s11263-006-0002-3, section 6; but one camera is left as it is, which saves
its share of the work.
"""

from collections.abc import Collection, Sequence
from functools import lru_cache

import cv2
import numpy as np

from panorama_stitch.compose.brightness import BrightnessRatio
from panorama_stitch.compose.layout import Layout, neighbours
from panorama_stitch.compose.placed import Placed

_CLIPPED_SHARE, _UNCLIPPED_SHARE = 0.02, 0.005
"""Of the samples: above the first white has to stay white, until it is no more than the second."""
_EVERY = 8
"""Panoramas from one comparison to the next."""
_SMALLEST_CHANGE, _SMALLEST_TINT = 0.002, 0.01
"""Factors that differ less from 1 are not worth the time; and from each other."""
_LARGEST_FACTOR = 4.0
_SLIDE = 0.85
"""What is left, from one comparison to the next, of the way to the factors of another choice."""
_UNKNOWN = 1e-3
"""Weight in a ring of a pair that was never compared."""
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

    def __init__(self, layout: Layout, placed: Placed, group: Sequence[np.ndarray]):
        """Prepare, and compare a group of pictures (height, width[, channels]), one a camera."""
        self.channels = channels = 1 if group[0].ndim == 2 else group[0].shape[2]
        self._pairs = [
            BrightnessRatio(layout, sum(seam) / 2, pair, channels)
            for seam, pair in zip(layout.seams, neighbours(placed), strict=True)
        ]
        self._multipliers = [_Multiplier(layout.surface.width, channels) for _ in group]
        self._age = 0
        for pair in self._pairs:
            pair.compare(group)
        self._is_clipped, self._reference = False, 0
        self._choose()
        self._way = np.zeros_like(self._needed())
        self._use_needed()

    @property
    def factors(self) -> np.ndarray:
        """(cameras, channels): what the pictures of each camera are multiplied by."""
        factors = np.exp(self._needed() + self._way)
        return factors.clip(1 / _LARGEST_FACTOR, _LARGEST_FACTOR)

    def update(self, images: Sequence[np.ndarray], stale: Collection[int] = ()) -> None:
        """Follow the pictures, one of each camera, that are about to be drawn.

        The brightness of `stale` cameras, told by their indices, does not count.
        """
        self._age = (self._age + 1) % _EVERY
        if not self._age:
            for pair in self._pairs:
                if not set(pair.cameras) & set(stale):
                    pair.compare(images)
            before = self._needed()
            self._choose()
            self._way = _SLIDE * (self._way + before - self._needed())
            self._use_needed()

    def apply(self, index: int, drawn: np.ndarray) -> None:
        """Multiply rows of the panorama in which camera `index` is drawn by its factors."""
        self._multipliers[index](drawn)

    def _choose(self) -> None:
        """Choose the camera that is left as it is, and whether white has to stay white."""
        # Where nothing is clipped the brighter pictures are darkened, so that nothing will be.
        # Where the sky is, darkened white would be grey, and a change of colour would tint it.
        limit = _UNCLIPPED_SHARE if self._is_clipped else _CLIPPED_SHARE
        self._is_clipped = any(pair.clipped > limit for pair in self._pairs)
        needed = self._needed().mean(axis=1)
        best = int(needed.argmin() if self._is_clipped else needed.argmax())
        if abs(needed[best]) > _SMALLEST_TINT:  # of two that are alike it stays the same one
            self._reference = best

    def _needed(self) -> np.ndarray:
        """(cameras, channels) logarithms of factors that make all as bright as the reference."""
        ratios = np.stack([pair.log_ratio for pair in self._pairs])
        if self._is_clipped:
            ratios = np.broadcast_to(ratios.mean(axis=1, keepdims=True), ratios.shape)
        weights = tuple(1.0 if pair.is_known else _UNKNOWN for pair in self._pairs)
        cameras = tuple(pair.cameras for pair in self._pairs)
        needed = _solution(cameras, weights, len(self._multipliers)) @ ratios
        return needed - needed[self._reference]

    def _use_needed(self) -> None:
        for multiplier, factors in zip(self._multipliers, self.factors, strict=True):
            multiplier.set(factors)


@lru_cache(maxsize=8)
def _solution(pairs: tuple[tuple[int, int], ...], weights: tuple[float, ...], cameras: int):
    """Return what takes ratios of pairs to logarithms of factors, (cameras, pairs).

    A chain is followed; around a ring, where the ratios contradict each other, the factors are
    those that fit best.
    """
    steps = np.zeros((len(pairs), cameras))
    for row, (left, right) in zip(steps, pairs, strict=True):
        row[right] += 1
        row[left] -= 1
    weight = np.asarray(weights)
    return np.linalg.pinv(steps * weight[:, None]) * weight


class _Multiplier:
    """Multiplies drawn rows; faster where all channels have the same factor."""

    def __init__(self, width: int, channels: int):
        self._weights: np.ndarray = np.full((_ROWS, width, channels), 255, np.uint8)
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
            if drawn.shape[1] > self._weights.shape[1]:  # a view is wider than the panorama
                self._weights = np.repeat(self._weights[:, :1], drawn.shape[1], axis=1)
            for top in range(0, len(drawn), _ROWS):
                part = drawn[top : top + _ROWS]
                cv2.multiply(
                    part,
                    self._weights[: len(part), : part.shape[1]],
                    dst=part,
                    scale=self._scale / 255,
                )
        elif abs(self._scale - 1) > _SMALLEST_CHANGE:
            cv2.convertScaleAbs(drawn, dst=drawn, alpha=self._scale)
