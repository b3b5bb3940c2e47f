"""Particles: the connected bright areas of a picture, and how they are found.

The steps are those of Al-Harasis and Sababha, "On the design and implementation of a dual fisheye
camera-based surveillance vision system", Multimedia Tools and Applications, 2019, doi
10.1007/s11042-019-7501-z.
"""

from dataclasses import dataclass

import cv2
import numpy as np

_FEW_PIXELS = 4 * 65535
"""So many pixels hold no more particles than 16 bits can tell apart, which is faster."""


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


def analyse(binary: np.ndarray) -> tuple[Particle, ...]:
    """Measure every particle (8-connected area of ones) of a binary picture (height, width)."""
    return tuple(Particle(*row) for row in measure(binary).tolist())


def measure(binary: np.ndarray, most: int | None = None) -> np.ndarray:
    """Measure the properties of the particles of a binary picture.

    Parameters
    ----------
    binary
        (height, width) uint8, 0 or 1.
    most
        How many to measure at most, the largest; None: all.

    Returns
    -------
    ndarray
        (n, 10) float64, the fields of `Particle`; by size where `most` was given.
    """
    few = binary.size < _FEW_PIXELS
    count, labels, stats, centers = cv2.connectedComponentsWithStats(
        binary, connectivity=8, ltype=cv2.CV_16U if few else cv2.CV_32S
    )
    chosen = np.arange(1, count)
    if most is not None:
        by_size = np.argsort(-stats[chosen, cv2.CC_STAT_AREA], kind='stable')
        chosen = chosen[by_size[:most]]
    flat = labels.ravel()
    inside = np.flatnonzero(binary)[::-1]
    first = np.zeros(count, int)
    first[flat[inside]] = inside  # the last one written is the first one seen
    first_y, first_x = np.divmod(first[chosen], binary.shape[1])
    left, top, width, height, area = stats[chosen].T
    return np.column_stack(
        [
            centers[chosen],
            first_x,
            first_y,
            left,
            top,
            left + width,
            top + height,
            area,
            100.0 * area / max(binary.size, 1),
        ]
    )


def scaled(properties: np.ndarray, scale: float) -> np.ndarray:
    """Return properties (n, 10) in px of a picture `scale` times as large."""
    properties = properties * np.array([*[scale] * 8, scale * scale, 1.0])
    properties[:, :2] += (scale - 1) / 2  # integers are pixel centres
    return properties
