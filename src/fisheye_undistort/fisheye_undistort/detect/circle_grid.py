"""Find the dark circles of a printed grid: threshold, particle filter, centre of mass."""

from dataclasses import dataclass

import cv2
import numpy as np

from fisheye_core.errors import ImageFormatError, SettingError

MIN_AREA_PX = 100.0
MAX_AREA_PX = 10_000.0
"""Areas of the particles that are kept in a picture of `_AREA_PICTURE_PX` pixels."""
_AREA_PICTURE_PX = 640 * 480
_BANDS = (1.0, 0.16, 4.0)
"""Shares of these areas that are tried."""
_LEAST_AREA_PX = 12.0
"""Smaller particles have no shape."""

_DARK_SHARE = 0.85
"""Darker than this share of the mean around it is dark: a shadow darkens both."""
_WINDOWS = (1.6, 0.7, 0.3)
"""Sizes of what is around, in diameters of the largest circle: each serves some circles."""
_MIN_ROUNDNESS = 0.92
_MIN_ASPECT = 0.15
"""A circle that is seen at 80 degrees from its axis is flatter; nothing can be measured there."""
_INSIDE = 0.7
"""Within this share of a circle's radius there is surely ink."""
_EDGE_PX, _EDGE = 2.0, (0.1, 0.3)
"""How far the blurred edge reaches beyond the radius, at least and at most in shares of it."""
_RING = 0.2
"""Width of the ring of paper beyond that, in radii: the sheet may end close by."""
_MAX_REFLECTED = 0.7
"""Ink gives back less than this share of what the paper around it does."""
_MAX_UNEVEN = 0.08
"""Paper around a circle that varies more than this, after its slope is removed, holds no plain
light to compare the ink with."""


@dataclass(frozen=True)
class Circles:
    """Dark, round particles of a picture.

    Attributes
    ----------
    centers
        (N, 2) centres of mass, px.
    shapes
        (N, 2, 2) second central moments, px^2: a quarter of the squared radius along each axis.
    """

    centers: np.ndarray
    shapes: np.ndarray

    def __len__(self):
        return len(self.centers)


_NONE = Circles(np.empty((0, 2)), np.empty((0, 2, 2)))


def area_bands(
    shape: tuple[int, ...], min_area_px: float = 0.0, max_area_px: float = 0.0
) -> list[tuple[float, float]]:
    """Limits of the particle filter to try, one after another, for a picture's shape.

    A limit that is given is kept. Without one, circles of the usual size are looked for, then
    smaller ones, then larger ones.
    """
    scale = shape[0] * shape[1] / _AREA_PICTURE_PX
    bands: list[tuple[float, float]] = []
    for share in (1.0,) if min_area_px and max_area_px else _BANDS:
        low = min_area_px or max(MIN_AREA_PX * scale * share, _LEAST_AREA_PX)
        high = max_area_px or MAX_AREA_PX * scale * share
        if low < high and (low, high) not in bands:
            bands.append((low, high))
    if not bands or bands[0][0] <= 0:
        raise SettingError(
            f'particles of {min_area_px:g} to {max_area_px:g} px are to be kept; '
            'expected min_area_px below max_area_px, both above 0'
        )
    return bands


def find_circles(gray: np.ndarray, min_area_px: float = 0.0, max_area_px: float = 0.0) -> Circles:
    """Find dark, round particles and measure their centres of mass.

    After Al-Harasis and Sababha 2019, doi 10.1007/s11042-019-7501-z, stage 1; the threshold
    adapts to the light, and grey levels weigh the centre of mass.

    Parameters
    ----------
    gray
        (height, width) uint8.
    min_area_px, max_area_px
        Particles that are kept; 0: 100 and 10,000 px at 640 x 480, scaled with the picture.

    Raises
    ------
    ImageFormatError
        If `gray` is not one channel of uint8.
    """
    if gray.ndim != 2 or gray.dtype != np.uint8:
        raise ImageFormatError(f'the picture is {gray.dtype}{gray.shape}; expected uint8 (h, w)')
    low, high = area_bands(gray.shape, min_area_px, max_area_px)[0]
    largest = 2 * np.sqrt(high / np.pi)
    found = [
        particle
        for size in _WINDOWS
        for particle in _particles(_dark(gray, size * largest), low, high)
    ]
    if not found:
        return _NONE
    centers, shapes = (np.array(part) for part in zip(*found, strict=True))
    new = _first_of_each(centers, shapes)
    printed = [
        measured
        for center, shape in zip(centers[new], shapes[new], strict=True)
        if (measured := _weigh(gray, center, shape))
    ]
    if not printed:
        return _NONE
    return Circles(*(np.array(part) for part in zip(*printed, strict=True)))


def _dark(gray: np.ndarray, window_px: float) -> np.ndarray:
    """Mark pixels darker than their surroundings, uint8 0 or 255."""
    side = 2 * int(window_px / 2) + 1
    around = cv2.blur(gray, (side, side), borderType=cv2.BORDER_REPLICATE)
    return cv2.compare(gray, cv2.convertScaleAbs(around, alpha=_DARK_SHARE), cv2.CMP_LT)


def _particles(dark: np.ndarray, low: float, high: float):
    """Centre and second moments of each particle that may be a circle."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(dark, connectivity=4)
    left, top, width, height, area = stats.T
    inside = (left > 0) & (top > 0)
    inside &= (left + width < dark.shape[1]) & (top + height < dark.shape[0])
    # An ellipse fills its box by pi / 4 at most, and at an angle much less.
    plausible = inside & (area >= low) & (area <= high) & (area < 0.87 * width * height)
    for label in np.flatnonzero(plausible):
        x, y = left[label], top[label]
        box = labels[y : y + height[label], x : x + width[label]] == label
        moments = cv2.moments(box.astype(np.uint8), binaryImage=True)
        shape = np.array([[moments['mu20'], moments['mu11']], [moments['mu11'], moments['mu02']]])
        shape /= area[label]
        small, large = np.linalg.eigvalsh(shape)
        if small <= _MIN_ASPECT**2 * large:
            continue
        # 1 for every ellipse, less for whatever is less compact.
        roundness = area[label] / (4 * np.pi * np.sqrt(small * large))
        if roundness >= _MIN_ROUNDNESS:
            yield (
                np.array([x + moments['m10'] / area[label], y + moments['m01'] / area[label]]),
                shape,
            )


def _first_of_each(centers: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    """Mark particles (N,) whose centre lies in none of those before: windows find them again."""
    offsets = centers[:, None] - centers
    distance = np.einsum('ijk,jkl,ijl->ij', offsets, np.linalg.inv(shapes), offsets)
    return ~np.any(np.tril(distance < 4, -1), axis=1)


def _weigh(gray: np.ndarray, center: np.ndarray, shape: np.ndarray):
    """Measure a circle again, each pixel weighed by the ink in it: edges are grey, not binary.

    Gives its centre and shape, or None for a dark spot that no white paper surrounds.
    """
    edge = 1 + np.clip(_EDGE_PX / (2 * np.sqrt(np.linalg.eigvalsh(shape)[0])), *_EDGE)
    reach = 2 * (edge + _RING) * np.sqrt(np.diag(shape))
    first = np.maximum(np.floor(center - reach), 0).astype(int)
    last = np.ceil(center + reach).astype(int) + 1
    patch = gray[first[1] : last[1], first[0] : last[0]].astype(float)
    y, x = np.mgrid[: patch.shape[0], : patch.shape[1]]
    x, y = x + first[0] - center[0], y + first[1] - center[1]
    inverse = np.linalg.inv(shape)
    radius = np.sqrt(inverse[0, 0] * x * x + 2 * inverse[0, 1] * x * y + inverse[1, 1] * y * y) / 2
    paper = (radius > edge) & (radius < edge + _RING)
    if np.median(patch[radius < _INSIDE]) > _MAX_REFLECTED * np.median(patch[paper]):
        return None
    plane = np.stack([np.ones(patch.shape), x, y], axis=-1)
    light = plane @ np.linalg.lstsq(plane[paper], patch[paper], rcond=None)[0]
    if light.min() <= 0 or np.std(patch[paper] / light[paper]) > _MAX_UNEVEN:
        return center, shape
    reflected = patch / light
    ink = (1 - reflected) / (1 - np.median(reflected[radius < _INSIDE]))
    ink[radius > edge] = 0.0
    offsets = np.stack([x, y], axis=-1)
    mean = np.tensordot(ink, offsets, 2) / ink.sum()
    offsets -= mean
    return center + mean, np.einsum('ij,ijk,ijl->kl', ink, offsets, offsets) / ink.sum()
