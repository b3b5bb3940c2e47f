"""Patches of the overlap, and the votes that they cast: how each is displaced between the views.

Every patch counts for its area, whatever its contrast. It is correlated with all places where the
other view may show it, and the shape of the best peak tells how well it is located in either
direction.
"""

import cv2
import numpy as np

from panorama_stitch.overlap.strips import Strips, seam_rays
from panorama_stitch.overlap.votes import Votes, no_votes, scaled

_AREA_RAD2 = np.radians(2.5) ** 2
"""Unit in which areas are counted."""
_LEAST_SEEN = 0.7
_LEAST_PEAK = 0.5
_SAME_PX, _SAME_RAD = 3, np.radians(1.0)
"""How far away along a row another peak is another place."""
_REPEATED, _REPEATED_CLOSE = 1.1, 0.02
"""How much more another place may leave unexplained, and be as good: a share, and what is added.
The patch is then no witness."""
_NOISE_FACTOR = 0.8
_GRAIN_PX = 4.0
"""Pixels that vary together."""
_FLOOR_PX = 0.12
"""No patch is located better."""


def cast_votes(
    strips: Strips, along_rad, across_rad: float, spacing_rad: float = np.radians(2.5)
) -> Votes:
    """Correlate every patch of the right strip with the left one.

    Parameters
    ----------
    strips
        The overlap.
    along_rad
        Smallest and largest displacement of the left view's patch along the rows.
    across_rad
        Largest one up and down.
    spacing_rad
        Between patches, which are twice as wide and high.
    """
    density = strips.density
    low, high = int(np.floor(along_rad[0] * density)), int(np.ceil(along_rad[1] * density))
    rise = int(np.ceil(across_rad * density))
    block = max(3, round(spacing_rad * density))
    rows, columns = (side // block for side in strips.right.image.shape)
    right, right_valid, noise = _detail(strips.right, block)
    left, left_valid, _ = _detail(strips.left, block)
    height, width = rows * block, columns * block
    right, right_valid = right[:height, :width], right_valid[:height, :width]
    border = (rise + 1, rise + 1, -low + 1, high + 1)
    left, left_valid = (
        cv2.copyMakeBorder(image, *border, cv2.BORDER_CONSTANT) for image in (left, left_valid)
    )
    if min(rows, columns) < 2:
        return no_votes()

    def patches(image):
        """Mean over each two by two blocks."""
        blocks = cv2.resize(image, (columns, rows), interpolation=cv2.INTER_AREA)
        pairs = blocks[:, 1:] + blocks[:, :-1]
        return (pairs[1:] + pairs[:-1]) / 4

    seen, energy = patches(right_valid), patches(right * right)
    chosen = (seen > _LEAST_SEEN) & (energy > _NOISE_FACTOR * seen * noise**2)
    size, first = (2 * block, 2 * block), (0, 0)
    left_energy, left_seen = (
        cv2.boxFilter(image, -1, size, anchor=first, borderType=cv2.BORDER_CONSTANT)
        for image in (left * left, left_valid)
    )
    shifts = (2 * rise + 3, high - low + 3)
    volume = np.zeros((*shifts, rows - 1, columns - 1), np.float32)
    for j in range(shifts[0]):
        for i in range(shifts[1]):
            both = patches(left[j : j + height, i : i + width] * right)
            corner = np.s_[j : j + height - block : block, i : i + width - block : block]
            scale = np.sqrt(left_energy[corner] * energy + 1e-6)
            np.divide(both, scale, out=volume[j, i], where=left_seen[corner] > _LEAST_SEEN)
    centers = [block * np.arange(1, count) - 0.5 for count in (rows, columns)]
    v, u = strips.v_rad[0] + centers[0] / density, strips.u_rad[0] + centers[1] / density
    votes = _peaks(volume, chosen, seen, u, v, (low - 1, -rise - 1), block, density)
    return scaled(votes, (block / density) ** 2 / _AREA_RAD2)


def _detail(strip, block):
    """Local detail, 0 where nothing is seen; its validity; and the deviation of its noise."""
    valid = strip.valid.astype(np.float32)
    weight = cv2.GaussianBlur(valid, (0, 0), 0.7) + 1e-6
    image = cv2.GaussianBlur(strip.image * valid, (0, 0), 0.7) / weight
    size = (2 * block + 1, 2 * block + 1)
    mean = cv2.blur(image * valid, size) / (cv2.blur(valid, size) + 1e-6)
    fine = cv2.Laplacian(strip.image, cv2.CV_32F)[strip.valid > 0]
    noise = float(np.median(np.abs(fine))) / 0.6745 / np.sqrt(20) if fine.size else 0.0
    return (image - mean) * valid, valid, max(noise, 0.5)


def _peaks(volume, chosen, seen, u, v, origin, block, density) -> Votes:
    u_all = u
    row, column = np.nonzero(chosen)
    if not len(row):
        return no_votes()
    scores = volume[:, :, row, column]
    inner = scores[1:-1, 1:-1]
    best = inner.reshape(-1, len(row)).argmax(axis=0)
    j, i = np.unravel_index(best, inner.shape[:2])
    edge = (j == 0) | (i == 0) | (j == inner.shape[0] - 1) | (i == inner.shape[1] - 1)
    j, i, n = j + 1, i + 1, np.arange(len(row))
    peak = scores[j, i, n]
    keep = (peak > _LEAST_PEAK) & ~edge & ~_repeated(scores, i, peak, density)
    shown = np.stack([v[row], np.cos(u[column])], axis=-1)
    row, column, j, i, peak, n = (values[keep] for values in (row, column, j, i, peak, n))
    shift, deviation = _located(scores, j, i, n, 2 * block, density)
    du, dv = ((shift + np.stack([i, j], -1) + origin) / density).T
    u, v = u[column], v[row]
    zero = np.zeros_like(u)
    along = np.stack([np.cos(u), -np.sin(u) * np.sin(v), -np.sin(u) * np.cos(v)], axis=-1)
    across = np.stack([zero, np.cos(v), -np.sin(v)], axis=-1)
    deviation[:, 1] *= np.maximum(np.cos(u), 0.3)
    return Votes(
        seam_rays(u, v),
        seam_rays(u + du, v + dv),
        along,
        across,
        deviation,
        np.cos(u),
        peak,
        shown,
        float((seen > _LEAST_SEEN).sum(axis=0) @ np.cos(u_all)),
    )


def _repeated(scores, i, peak, density):
    """(n,) bool: where another place along the row is as good as the best one, in column `i`."""
    profile = scores.max(axis=0)
    away = np.abs(np.arange(len(profile))[:, None] - i) > max(_SAME_PX, _SAME_RAD * density)
    unexplained = 1 - np.where(away, profile, -1.0).max(axis=0)
    return unexplained < _REPEATED * (1 - peak) + _REPEATED_CLOSE


def _located(scores, j, i, n, side, density):
    """Fractions of a pixel (n, 2) by which peaks lie right and below, and deviations, rad."""
    at = scores[j, i, n]
    first = (
        np.stack(
            [scores[j, i + 1, n] - scores[j, i - 1, n], scores[j + 1, i, n] - scores[j - 1, i, n]],
            -1,
        )
        / 2
    )
    second = np.stack(
        [
            2 * at - scores[j, i + 1, n] - scores[j, i - 1, n],
            2 * at - scores[j + 1, i, n] - scores[j - 1, i, n],
        ],
        -1,
    )
    mixed = (
        scores[j + 1, i + 1, n]
        + scores[j - 1, i - 1, n]
        - scores[j + 1, i - 1, n]
        - scores[j - 1, i + 1, n]
    ) / 4
    second = np.maximum(second, 1e-5)
    hessian = np.zeros((len(at), 2, 2))
    hessian[:, 0, 0], hessian[:, 1, 1] = second.T
    hessian[:, 0, 1] = hessian[:, 1, 0] = -np.clip(mixed, -1, 1) * (
        np.abs(mixed) < 0.98 * np.sqrt(second[:, 0] * second[:, 1])
    )
    covariance = np.linalg.inv(hessian)
    shift = np.clip(first / second, -0.5, 0.5)
    independent = side * side / _GRAIN_PX
    spread = np.sqrt(
        np.diagonal(covariance, axis1=1, axis2=2)
        * (np.maximum(1 - at * at, 0.02) / independent)[:, None]
    )
    return shift, np.sqrt(spread**2 + _FLOOR_PX**2) / density
