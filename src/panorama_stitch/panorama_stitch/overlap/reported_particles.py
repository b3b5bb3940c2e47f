"""The particles of two facing halves, and the pair of them that the measured rotation matches.

They are looked for in what changes along the rows, at several thresholds and in both polarities,
so that exposure does not matter.
"""

from dataclasses import replace
from math import radians

import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.overlap.particles import (
    Particle,
    facing_halves,
    measure,
    open_binary,
    scaled,
)
from panorama_stitch.overlap.structure import structure

_PX_PER_DEG = 2.0
_LEVELS = (0.6, 1.2)
"""Thresholds of the structure, for bright particles; dark ones lie below their negatives."""
_MOST = 40
"""Particles a threshold, the largest ones."""
_SAME_RAD = radians(1.5)
"""Centres of mass of one thing seen from two places lie nearer to each other."""
_AREA, _SIZES = 8, (4, 5, 6, 7)
"""Columns of the area and of the bounding box among the ten properties."""


def with_particles(
    overlap: Overlap, images: tuple[np.ndarray, np.ndarray], surfaces: tuple[Surface, Surface]
) -> Overlap:
    """Return an overlap with the particles of both corrected images.

    Parameters
    ----------
    overlap
        What was measured.
    images, surfaces
        Corrected grey images (height, width) uint8, left and right, and what they are on.

    Returns
    -------
    Overlap
        Matched are the two particles that are most alike of those that the rotation brings
        together; none where no overlap was found.
    """
    halves = facing_halves(*images)
    step = max(1, round(surfaces[0].focal_px * radians(1) / _PX_PER_DEG))
    step = max(1, min(step, min(min(half.shape) for half in halves) // 8))
    found = [_particles(half, step) for half in halves]
    left, right = (properties for properties, _ in found)
    overlap = replace(
        overlap,
        left_particles=tuple(Particle(*row) for row in left.tolist()),
        right_particles=tuple(Particle(*row) for row in right.tolist()),
    )
    if overlap.attitude is None or not (len(left) and len(right)):
        return overlap
    half_start = images[0].shape[1] - halves[0].shape[1]
    left_rays = _unit(surfaces[0].rays(left[:, 0] + half_start, left[:, 1]))
    right_rays = _unit(surfaces[1].rays(right[:, 0], right[:, 1])) @ overlap.attitude.matrix.T
    apart_rad = np.arccos(np.clip(left_rays @ right_rays.T, -1.0, 1.0))
    same_kind = np.equal.outer(found[0][1], found[1][1])
    unlike = np.where((apart_rad < _SAME_RAD) & same_kind, _unlikeness(left, right), np.inf)
    n, m = np.unravel_index(np.argmin(unlike), unlike.shape)
    if not np.isfinite(unlike[n, m]):
        return overlap
    return replace(
        overlap,
        left_match=int(n),
        right_match=int(m),
        min_correlation_value=float(np.abs(left[n] - right[m]).mean()),
    )


def _particles(half: np.ndarray, step: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the properties (n, 10) of a half's particles, px of it, and their kind (n,)."""
    image = structure(half, step).image
    properties, kinds = [np.zeros((0, 10))], [np.zeros(0, int)]
    for kind, (level, sign) in enumerate((level, sign) for level in _LEVELS for sign in (1, -1)):
        binary = open_binary((sign * image > level).view(np.uint8))
        properties.append(measure(binary, most=_MOST))
        kinds.append(np.full(len(properties[-1]), kind))
    return scaled(np.concatenate(properties), step), np.concatenate(kinds)


def _unlikeness(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """How much areas and sizes differ in their logarithms, large particles first, (n, m)."""
    total = np.zeros((len(left), len(right)))
    sizes = [_sizes(one) for one in (left, right)]
    for mine, theirs in zip(*sizes, strict=True):
        total += np.abs(np.subtract.outer(np.log(mine), np.log(theirs)))
    return total - 0.1 * np.log(np.add.outer(left[:, _AREA], right[:, _AREA]))


def _sizes(properties: np.ndarray) -> list[np.ndarray]:
    left, top, right, bottom = properties[:, _SIZES].T
    return [properties[:, _AREA], right - left, bottom - top]


def _unit(rays: np.ndarray) -> np.ndarray:
    return rays / np.linalg.norm(rays, axis=-1, keepdims=True)
