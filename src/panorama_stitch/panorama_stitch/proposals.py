"""Offsets that particles propose: what looks alike in both pictures votes for its shift.

Only properties that stay under the shift count (area, size, height of the centre); where a particle
lies does not.
"""

from collections.abc import Sequence

import cv2
import numpy as np

from panorama_stitch.particles import Particle, analyse
from panorama_stitch.structure import Structure

_LEVELS = (0.6, 1.2)
"""Thresholds in local contrast, bright above and dark below zero."""
_SMALLEST_PX = 3
_LARGEST_SHARE = 0.1


def find_particles(view: Structure, scale: float) -> list[tuple[Particle, ...]]:
    """Find the particles of a structure at several thresholds and both polarities.

    Returns
    -------
    list of tuple of Particle
        One tuple a threshold, in px of a picture `scale` times as large.
    """
    return [
        _of_fair_size(analyse((sign * view.detail > level).astype(np.uint8), scale), scale)
        for level in _LEVELS
        for sign in (1, -1)
    ]


def _of_fair_size(particles, scale):
    return tuple(
        p for p in particles
        if p.area >= _SMALLEST_PX * scale**2 and p.area_percent <= 100 * _LARGEST_SHARE
    )


def pair_up(left: Sequence[Particle], right: Sequence[Particle], rise_px: float):
    """Find the pairs that may be the same thing.

    Returns
    -------
    indices : ndarray
        (n, 2) of left and right.
    shifts : ndarray
        (n, 2) from the right particle's centre to the left one's, px.
    likeness : ndarray
        (n,) 0 to 1.
    """
    if not (left and right):
        return np.zeros((0, 2), int), np.zeros((0, 2)), np.zeros(0)
    a, b = (_shape(particles) for particles in (left, right))
    difference = np.abs(a[:, None, 2:] - b[None, :, 2:]).sum(axis=2)
    rise = a[:, None, 1] - b[None, :, 1]
    indices = np.argwhere((np.abs(rise) <= rise_px) & (difference < 1.0))
    n, m = indices.T
    return indices, a[n, :2] - b[m, :2], np.exp(-3 * difference[n, m])


def _shape(particles):
    """Centre, and the logarithms of area, width and height: (n, 5)."""
    return np.array([
        (p.center_x, p.center_y, *np.log([p.area, p.right - p.left, p.bottom - p.top]))
        for p in particles
    ])


def vote(shifts: np.ndarray, likeness: np.ndarray, cell_px: float, count: int) -> np.ndarray:
    """Cluster proposed shifts (n, 2) and give the `count` places (k, 2) with most votes, px."""
    if not len(shifts):
        return np.zeros((0, 2))
    low = shifts.min(axis=0) - 2 * cell_px
    cells = np.floor((shifts - low) / cell_px).astype(int)
    votes = np.zeros(cells.max(axis=0) + 3, np.float32)
    np.add.at(votes, tuple(cells.T), likeness)
    votes = cv2.blur(votes, (3, 3), borderType=cv2.BORDER_CONSTANT)
    places = []
    while len(places) < count and votes.max() > 0:
        i, j = np.unravel_index(np.argmax(votes), votes.shape)
        places.append(low + (np.array([i, j]) + 0.5) * cell_px)
        votes[max(i - 1, 0) : i + 2, max(j - 1, 0) : j + 2] = 0
    return np.array(places)
