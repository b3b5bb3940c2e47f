"""Blending: how two views become one in the columns in which both are drawn."""

from itertools import pairwise
from math import log2
from typing import Protocol

import cv2
import numpy as np

from panorama_stitch.compose.ramp import Fading, ramp_over

_COARSEST_COLUMNS = 8
"""A multiband blend halves its strip until so few columns are left to fade over."""
_ALONE = 1e-4
_UNIT = 1 << 14
"""A weight of 1, as an integer."""


class Blend(Protocol):
    """Makes one picture of two views.

    Attributes
    ----------
    is_local
        Whether a row's blend follows from that row alone.
    needs_overlap
        Whether it needs what lies beside the seam, too, as far as both views show it.
    """

    is_local: bool
    needs_overlap: bool

    def __call__(
        self,
        left: np.ndarray,
        right: np.ndarray,
        rows: slice = slice(None),
        *,
        economical: bool = False,
    ) -> None:
        """Blend views (height, width[, channels]) uint8 into the place of the right one.

        The left view is of no use any more afterwards.

        Parameters
        ----------
        rows
            Which rows these are, all where the blend is not local.
        economical
            Leave out what takes long.
        """


class BlendKind(Protocol):
    """Class of a blend, called with where each view shows anything and where one fades."""

    needs_overlap: bool

    def __call__(
        self,
        left_seen: np.ndarray,
        right_seen: np.ndarray,
        fade: Fading = None,
        /,
    ) -> Blend:
        """Prepare the blend of a seam."""


class Feather:
    """Fades from the left view into the right one."""

    is_local, needs_overlap = True, False

    def __init__(
        self,
        left_seen: np.ndarray,
        right_seen: np.ndarray,
        fade: Fading = None,
    ):
        """Prepare.

        Parameters
        ----------
        left_seen, right_seen
            (height, width) bool: where each view shows anything; elsewhere the other is alone.
        fade
            Where one view gives way to the other.
        """
        # Beyond the fade a view shows where it is alone, and so little elsewhere that nobody sees.
        ramp = ramp_over(left_seen.shape, fade).clip(_ALONE, 1 - _ALONE)
        weights = left_seen * (1 - ramp), right_seen * ramp
        # Where no view shows anything it stays black with any weights.
        total = np.maximum(weights[0] + weights[1], np.finfo(np.float32).tiny)
        self._weights = [np.ascontiguousarray(weight / total) for weight in weights]

    def __call__(
        self,
        left: np.ndarray,
        right: np.ndarray,
        rows: slice = slice(None),
        *,
        economical: bool = False,
    ) -> None:
        """As `Blend`."""
        left_weight, right_weight = self._weights
        cv2.blendLinear(left, right, left_weight[rows], right_weight[rows], dst=right)


class Alone:
    """Where one view is alone; the other is made to show the same there: they do not differ."""

    def __init__(self, left_seen: np.ndarray, right_seen: np.ndarray):
        self._left = (left_seen & ~right_seen).astype(np.uint8)
        self._right = (right_seen & ~left_seen).astype(np.uint8)

    def fill(self, left: np.ndarray, right: np.ndarray) -> None:
        """Copy to each of two views what only the other one shows."""
        cv2.copyTo(left, self._left, right)
        cv2.copyTo(right, self._right, left)


class Multiband:
    """Fades coarse detail over the whole width and fine detail over little of it.

    A blend is linear in the views, so the pyramid of their difference is enough (P. J. Burt,
    E. H. Adelson, "A multiresolution spline with application to image mosaics", 1983,
    https://doi.org/10.1145/245.247).
    """

    is_local, needs_overlap = False, False

    def __init__(
        self,
        left_seen: np.ndarray,
        right_seen: np.ndarray,
        fade: Fading = None,
    ):
        """Prepare; parameters as of `Feather`."""
        ramp = ramp_over(left_seen.shape, fade)
        fading_px = int(((ramp > 0) & (ramp < 1)).sum(axis=1).max(initial=1))
        self._alone = Alone(left_seen, right_seen)
        self._weights = [(ramp <= 0.5).astype(np.float32)]
        for _ in range(max(1, int(log2(max(1, fading_px) / _COARSEST_COLUMNS)))):
            self._weights.append(cv2.pyrDown(self._weights[-1]))
        self._levels: list[_Level] = []
        self._shape: tuple[int, ...] = ()

    def __call__(
        self,
        left: np.ndarray,
        right: np.ndarray,
        rows: slice = slice(None),
        *,
        economical: bool = False,
    ) -> None:
        """As `Blend`."""
        if self._shape != right.shape:
            self._shape = right.shape
            self._levels = [_Level(weight, right.shape[2:]) for weight in self._weights]
        self._alone.fill(left, right)
        levels = self._levels
        cv2.subtract(left, right, dst=levels[0].band, dtype=cv2.CV_16S)
        for fine, coarse in pairwise(levels):
            cv2.pyrDown(fine.band, dst=coarse.band)
        for fine, coarse in pairwise(levels):
            cv2.subtract(fine.band, fine.enlarged(coarse), dst=fine.band)
        for level in levels:
            cv2.multiply(level.band, level.weight, dst=level.band, scale=1 / _UNIT)
        for coarse, fine in pairwise(reversed(levels)):
            cv2.add(fine.band, fine.enlarged(coarse), dst=fine.band)
        cv2.add(right, levels[0].band, dst=right, dtype=cv2.CV_8U)


class _Level:
    """One level of a pyramid: its picture, (height, width[, channels]) int16, and its weights."""

    def __init__(self, weight: np.ndarray, channels: tuple[int, ...]):
        self.weight = (weight * _UNIT).astype(np.int16)
        if channels:
            self.weight = cv2.merge([self.weight] * channels[0])
        self.band = np.empty_like(self.weight)
        self._room = np.empty_like(self.weight)

    def enlarged(self, coarse: '_Level') -> np.ndarray:
        """Return the picture of the next coarser level in the size of this one."""
        return cv2.pyrUp(coarse.band, dst=self._room, dstsize=self._room.shape[1::-1])
