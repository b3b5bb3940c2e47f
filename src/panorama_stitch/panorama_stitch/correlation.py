"""Full search: how well two structures correlate at every offset, by Fourier transforms.

The normalisation counts only pixels that both pictures have, as in Padfield, "Masked object
registration in the Fourier domain", IEEE TIP 21(5), 2012, doi 10.1109/TIP.2011.2181402; the
structures have no mean to subtract.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.structure import Reduced

_DOUBT = 6.0
"""How far chance carries the correlation of n pixels is about this over sqrt(n)."""


@dataclass(frozen=True)
class Landscape:
    """Correlation of two structures at every offset of a search range.

    Attributes
    ----------
    x, y
        (columns,), (rows,) int: offsets of the right structure in the left one, px.
    correlation
        (rows, columns) float32, -1 to 1.
    score
        (rows, columns) float32: `correlation` less what chance may give an overlap of that size.
    """

    x: np.ndarray
    y: np.ndarray
    correlation: np.ndarray
    score: np.ndarray

    def peaks(self, count: int, apart_px: int) -> list[tuple[int, int]]:
        """Give up to `count` indices (row, column) of highest score, `apart_px` columns apart."""
        score = self.score.copy()
        found = []
        while len(found) < count:
            row, column = np.unravel_index(np.argmax(score), score.shape)
            if score[row, column] <= 0:
                break
            found.append((int(row), int(column)))
            score[:, np.abs(self.x - self.x[column]) <= apart_px] = -1
        return found


def correlate(
    left: Reduced, right: Reduced, x: range, y: range, min_pixels: int
) -> Landscape:
    """Correlate two structures at the offsets `x`, `y`; fewer common pixels score -1."""
    shape = tuple(
        cv2.getOptimalDFTSize(max(a, b) + max(map(abs, (*offsets, 0))))
        for a, b, offsets in zip(left.image.shape, right.image.shape, (y, x), strict=True)
    )
    rows, columns = np.asarray(y), np.asarray(x)
    spot = np.ix_(rows % shape[0], columns % shape[1])
    (l, l2, l1), (r, r2, r1) = (
        [_spectrum(image, shape) for image in (s.image, s.image * s.image, s.valid)]
        for s in (left, right)
    )
    both, left_energy, right_energy, pixels = (
        cv2.dft(cv2.mulSpectrums(a, b, 0, conjB=True), flags=cv2.DFT_INVERSE | cv2.DFT_SCALE)[spot]
        for a, b in ((l, r), (l2, r1), (l1, r2), (l1, r1))
    )
    energy = np.sqrt(np.maximum(left_energy, 0) * np.maximum(right_energy, 0))
    correlation = both / np.maximum(energy, 1.0)
    score = np.where(pixels >= min_pixels, less_chance(correlation, energy, pixels), -1.0)
    return Landscape(columns, rows, correlation, score)


def less_chance(correlation, energy, pixels):
    """Lower a correlation by what chance may give so few pixels, or so little structure."""
    # Flat areas say nothing: they do not count as evidence.
    return correlation - _DOUBT / np.sqrt(np.maximum(np.minimum(energy, pixels), 1.0))


def _spectrum(image, shape):
    padded = np.zeros(shape, np.float32)
    padded[: image.shape[0], : image.shape[1]] = image
    return cv2.dft(padded)
