"""Particles: the connected bright areas of a picture, and how they are found.

The steps are those of Al-Harasis and Sababha, "On the design and implementation of a dual fisheye
camera-based surveillance vision system", Multimedia Tools and Applications, 2019, doi
10.1007/s11042-019-7501-z.
"""

from dataclasses import astuple, dataclass

import cv2
import numpy as np


@dataclass(frozen=True)
class Particle:
    """Ten properties of a particle, px of the picture it was found in.

    The first pixel is the leftmost of its uppermost row; `right` and `bottom` are the first
    column and row beyond it.
    """

    center_x: float
    center_y: float
    first_pixel_x: float
    first_pixel_y: float
    left: float
    top: float
    right: float
    bottom: float
    area: float
    area_percent: float

    def __array__(self, dtype=None, copy=None) -> np.ndarray:
        """Give the properties in order."""
        return np.array(astuple(self), dtype or float)


def facing_halves(left: np.ndarray, right: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Crop each frame to the half that faces the other camera (views, not copies)."""
    return left[:, left.shape[1] - left.shape[1] // 2 :], right[:, : right.shape[1] // 2]


def cluster_thresholds(grey: np.ndarray, classes: int = 2) -> tuple[float, ...]:
    """Find grey levels that part a picture's histogram into classes around their centres of mass.

    Parameters
    ----------
    grey
        (height, width) uint8.
    classes
        How many, at least 2.

    Returns
    -------
    tuple of float
        `classes` - 1 increasing levels, midway between the centres of neighbouring classes.
    """
    histogram = np.bincount(grey.ravel(), minlength=256).astype(float)
    levels = np.arange(256.0)
    present = np.flatnonzero(histogram)
    centers = np.linspace(present[0], present[-1], 2 * classes + 1)[1::2]
    while True:
        thresholds = (centers[:-1] + centers[1:]) / 2
        label = np.searchsorted(thresholds, levels, side='left')
        mass = np.bincount(label, histogram, classes)
        moment = np.bincount(label, histogram * levels, classes)
        moved = np.divide(moment, mass, out=centers.copy(), where=mass > 0)
        if np.allclose(moved, centers, atol=1e-6):
            return tuple(map(float, thresholds))
        centers = moved


def open_binary(binary: np.ndarray, size: int = 3) -> np.ndarray:
    """Detach particles and drop thin edges: open with a `size` x `size` square."""
    return cv2.morphologyEx(binary, cv2.MORPH_OPEN, np.ones((size, size), np.uint8))


def remove_small(binary: np.ndarray, erosions: int = 9) -> np.ndarray:
    """Keep, in their full shape, the particles of which something is left after erosions.

    Parameters
    ----------
    binary
        (height, width) uint8, 0 or 1.
    erosions
        How often a 3 x 3 square erodes.
    """
    cores = cv2.erode(binary, np.ones((3, 3), np.uint8), iterations=erosions)
    count, labels = cv2.connectedComponents(binary, connectivity=8)
    kept = np.zeros(count, np.uint8)
    kept[labels[cores > 0]] = 1
    kept[0] = 0
    return kept[labels]


def analyse(
    binary: np.ndarray, scale: float = 1.0, *, smallest_px: int = 1, most: int | None = None
) -> tuple[Particle, ...]:
    """Measure the ten properties of every particle (8-connected area of ones).

    Parameters
    ----------
    binary
        (height, width) uint8, 0 or 1.
    scale
        Size of its pixels, in those of the picture that the properties are meant for.
    smallest_px
        Area below which a particle is left out, px of `binary`.
    most
        How many to give at most, the largest; None: all.

    Returns
    -------
    tuple of Particle
        From top to bottom; where `most` was given, by size.
    """
    _, labels, stats, centers = cv2.connectedComponentsWithStats(binary, connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA]
    chosen = np.flatnonzero(areas >= smallest_px) + 1
    if most is not None:
        chosen = chosen[np.argsort(-areas[chosen - 1], kind='stable')[:most]]
    percent = 100.0 / max(binary.size, 1)
    particles = []
    for label in chosen:
        left, top, width, height, area = map(int, stats[label])
        first = left + int(np.argmax(labels[top, left : left + width] == label))
        center_x, center_y = (float(center + 0.5) * scale - 0.5 for center in centers[label])
        lengths = (first, top, left, top, left + width, top + height)
        particles.append(
            Particle(
                center_x, center_y, *(float(length * scale) for length in lengths),
                float(area * scale * scale), area * percent,
            )
        )
    return tuple(particles)
