"""Offsets that particles propose: what looks alike in both pictures votes for its shift.

Particles are looked for in the structure of the pictures, at several thresholds and in both
polarities, so that exposure does not matter. Only properties that a shift leaves alone tell what
is alike (area, width, height, and how high it lies), not where it lies or how an edge cuts it.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.correlation import Landscape
from panorama_stitch.particles import Particle, analyse
from panorama_stitch.structure import Facing

_LEVELS = (0.6, 1.2)
"""Thresholds of the structure, for bright particles; dark ones lie below their negatives."""
_SMALLEST_PX = 4
_MOST = 60
"""Particles a threshold, the largest ones."""
_UNLIKE = 0.8
"""Pairs whose area, width and height differ by more in their logarithms are not tried."""
_SHARPNESS = 4.0
_CLUSTER_PX = 5
"""Shifts this near to each other vote for the same offset."""


@dataclass(frozen=True)
class Proposals:
    """Particles of two facing halves, and which of them may be the same thing.

    Attributes
    ----------
    left, right
        Particles, px of the unreduced halves.
    pairs
        (n, 2) int: indices into both.
    shifts
        (n, 2) from the right one's centre to the left one's, px of the structures.
    likeness
        (n,) 0 to 1.
    """

    left: tuple[Particle, ...]
    right: tuple[Particle, ...]
    pairs: np.ndarray
    shifts: np.ndarray
    likeness: np.ndarray

    def offsets(self, landscape: Landscape, count: int) -> list[tuple[int, int]]:
        """Give the `count` offsets (x, y) with most votes, each moved to where it fits best."""
        votes = np.zeros(landscape.score.shape, np.float32)
        column, row = np.rint(self.shifts - (landscape.x[0], landscape.y[0])).astype(int).T
        inside = (row >= 0) & (row < votes.shape[0]) & (column >= 0) & (column < votes.shape[1])
        np.add.at(votes, (row[inside], column[inside]), self.likeness[inside])
        votes = cv2.blur(votes, (_CLUSTER_PX, _CLUSTER_PX), borderType=cv2.BORDER_CONSTANT)
        chosen = Landscape(landscape.x, landscape.y, votes).peaks(count, _CLUSTER_PX)
        return list(dict.fromkeys(landscape.best_near(*one, _CLUSTER_PX // 2) for one in chosen))

    def match_at(self, x: float, y: float) -> tuple[int, int]:
        """Give the pair (left, right) that fits an offset best, (-1, -1) where none does."""
        miss = np.abs(self.shifts - (x, y)).max(axis=1, initial=0.0)
        fits = np.flatnonzero(miss <= _CLUSTER_PX / 2)
        if not len(fits):
            return -1, -1
        area = np.array([self.left[n].area for n in self.pairs[fits, 0]])
        best = fits[np.argmax(self.likeness[fits] * np.sqrt(area))]
        return int(self.pairs[best, 0]), int(self.pairs[best, 1])


def propose(facing: Facing, max_rise_px: float) -> Proposals:
    """Find the particles of two structures and pair up those that may be the same thing."""
    sides = [], []
    pairs, likeness, first = [], [], (0, 0)
    level_y_px = facing.level_y_px * facing.step
    for level in _LEVELS:
        for sign in (1, -1):
            found = [
                analyse(
                    (sign * one.image > level).view(np.uint8), facing.step,
                    smallest_px=_SMALLEST_PX, most=_MOST,
                )
                for one in (facing.left, facing.right)
            ]
            indices, alike = _pair_up(*found, level_y_px, max_rise_px * facing.step)
            pairs.append(indices + first)
            likeness.append(alike)
            for side, particles in zip(sides, found, strict=True):
                side.extend(particles)
            first = tuple(map(len, sides))
    left, right = map(tuple, sides)
    pairs = np.concatenate(pairs)
    centers = [
        np.array([(p.center_x, p.center_y) for p in particles]).reshape(-1, 2)
        for particles in sides
    ]
    shifts = (centers[0][pairs[:, 0]] - centers[1][pairs[:, 1]]) / facing.step
    return Proposals(left, right, pairs, shifts, np.concatenate(likeness))


def _pair_up(left, right, level_y_px, max_rise_px):
    """Pairs (n, 2) of like particles at like heights, and how alike they are (n,)."""
    if not (left and right):
        return np.zeros((0, 2), int), np.zeros(0)
    (height, shape), (other_height, other) = (
        (
            np.array([p.center_y for p in particles]),
            np.log([(p.area, p.right - p.left, p.bottom - p.top) for p in particles]),
        )
        for particles in (left, right)
    )
    difference = np.abs(shape[:, None] - other[None]).sum(axis=2)
    rise = np.abs(height[:, None] - other_height[None] - level_y_px)
    pairs = np.argwhere((difference <= _UNLIKE) & (rise <= max_rise_px))
    return pairs, np.exp(-_SHARPNESS * difference[tuple(pairs.T)])
