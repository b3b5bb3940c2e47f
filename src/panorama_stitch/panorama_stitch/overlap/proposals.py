"""Offsets that particles propose: what looks alike in both pictures votes for its shift.

Particles are looked for in the structure of the pictures, at several thresholds and in both
polarities, so that exposure does not matter. Only properties that a shift leaves alone tell what
is alike (area, width, height, and how high it lies), not where it lies or how an edge cuts it.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.overlap.correlation import ScoreMap
from panorama_stitch.overlap.particles import measure, open_binary, scaled
from panorama_stitch.overlap.structure import FacingPair

_LEVELS = (0.6, 1.2)
"""Thresholds of the structure, for bright particles; dark ones lie below their negatives."""
_AREA = 8
"""Column of the area."""
_MOST = 40
"""Particles a threshold, the largest ones."""
_UNLIKE = 0.8
"""Pairs whose area, width and height differ by more in their logarithms are not tried."""
_SHARPNESS = 4.0
_CLUSTER_PX = 5
"""Shifts this near to each other vote for the same offset."""


@dataclass(frozen=True)
class Proposals:
    """Particles of two structures, and which of them may be the same thing; all in their px.

    Attributes
    ----------
    left, right
        (n, 10), (m, 10) properties of particles.
    pairs
        (n, 2) int: indices into both.
    shifts
        (n, 2) from the right one's centre to the left one's.
    likeness
        (n,) 0 to 1.
    """

    left: np.ndarray
    right: np.ndarray
    pairs: np.ndarray
    shifts: np.ndarray
    likeness: np.ndarray

    def offsets(self, landscape: ScoreMap, count: int) -> list[tuple[int, int]]:
        """Give the `count` offsets (x, y) with most votes, each moved to where it fits best."""
        votes = np.zeros(landscape.score.shape, np.float32)
        column, row = np.rint(self.shifts - (landscape.x[0], landscape.y[0])).astype(int).T
        inside = (row >= 0) & (row < votes.shape[0]) & (column >= 0) & (column < votes.shape[1])
        np.add.at(votes, (row[inside], column[inside]), self.likeness[inside])
        votes = cv2.blur(votes, (_CLUSTER_PX, _CLUSTER_PX), borderType=cv2.BORDER_CONSTANT)
        chosen = ScoreMap(landscape.x, landscape.y, votes).peaks(count, _CLUSTER_PX)
        return list(dict.fromkeys(landscape.best_near(*one, _CLUSTER_PX // 2) for one in chosen))

    def match_at(self, x: float, y: float) -> tuple[int, int]:
        """Give the pair (left, right) that fits an offset best, (-1, -1) where none does."""
        miss = np.abs(self.shifts - (x, y)).max(axis=1, initial=0.0)
        fits = np.flatnonzero(miss <= _CLUSTER_PX / 2)
        if not len(fits):
            return -1, -1
        area = self.left[self.pairs[fits, 0], _AREA]
        best = fits[np.argmax(self.likeness[fits] * np.sqrt(area))]
        return int(self.pairs[best, 0]), int(self.pairs[best, 1])

    def scaled(self, scale: float) -> 'Proposals':
        """Give the same in px of pictures `scale` times as large."""
        left, right = scaled(self.left, scale), scaled(self.right, scale)
        return Proposals(left, right, self.pairs, self.shifts * scale, self.likeness)


def propose(facing: FacingPair, max_rise_px: float) -> Proposals:
    """Find the particles of two structures and pair up those that may be the same thing."""
    empty = np.zeros((0, 10))
    sides = [empty], [empty]
    pairs, likeness, before = [np.zeros((0, 2), int)], [np.zeros(0)], np.zeros(2, int)
    for level in _LEVELS:
        for sign in (1, -1):
            found = [
                measure(open_binary((sign * one.image > level).view(np.uint8)), most=_MOST)
                for one in (facing.left, facing.right)
            ]
            indices, alike = _pair_up(*found, facing.level_y_px, max_rise_px)
            pairs.append(indices + before)
            likeness.append(alike)
            for side, properties in zip(sides, found, strict=True):
                side.append(properties)
            before += list(map(len, found))
    (left, right), pairs = map(np.concatenate, sides), np.concatenate(pairs)
    shifts = left[pairs[:, 0], :2] - right[pairs[:, 1], :2]
    return Proposals(left, right, pairs, shifts, np.concatenate(likeness))


def _pair_up(left, right, level_y_px, max_rise_px):
    """Pairs (n, 2) of like particles at like heights, and how alike they are (n,)."""
    shape, other = (
        np.log(np.column_stack([p[:, _AREA], p[:, 6] - p[:, 4], p[:, 7] - p[:, 5]]))
        for p in (left, right)
    )
    difference = np.abs(shape[:, None] - other[None]).sum(axis=2)
    rise = np.abs(left[:, None, 1] - right[None, :, 1] - level_y_px)
    pairs = np.argwhere((difference <= _UNLIKE) & (rise <= max_rise_px))
    return pairs, np.exp(-_SHARPNESS * difference[tuple(pairs.T)])
