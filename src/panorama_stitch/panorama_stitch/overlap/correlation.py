"""Full search: how well two structures correlate at every offset, by Fourier transforms.

The normalisation counts only pixels that both pictures have, as in Padfield, "Masked object
registration in the Fourier domain", IEEE TIP 21(5), 2012, doi 10.1109/TIP.2011.2181402; the
structures have no mean to subtract.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.overlap.structure import FacingPair

_DOUBT = 6.0
"""Chance carries the correlation of n smooth pixels up to about this over sqrt(n)."""


@dataclass(frozen=True)
class ScoreMap:
    """How well two structures fit at every offset of a search range.

    Attributes
    ----------
    x, y
        (columns,), (rows,) int: offsets of the right structure in the left one, px.
    score
        (rows, columns) float32: the correlation less what chance may give so small an overlap.
    """

    x: np.ndarray
    y: np.ndarray
    score: np.ndarray

    def peaks(self, count: int, apart_px: int) -> list[tuple[int, int]]:
        """Return up to `count` offsets (x, y) with the highest scores above 0, highest first.

        At the first and last `y` there is none: the score may go on rising beyond.
        """
        score = self.score.copy()
        found = []
        while len(found) < count:
            row, column = np.unravel_index(np.argmax(score), score.shape)
            if score[row, column] <= 0:
                break
            if 0 < row < len(self.y) - 1:
                found.append((int(self.x[column]), int(self.y[row])))
            score[:, np.abs(self.x - self.x[column]) <= apart_px] = -1
        return found

    def score_at(self, x: int, y: int) -> float:
        """Score of an offset of the range."""
        return float(self.score[y - self.y[0], x - self.x[0]])

    def best_away_from(self, x: float, apart_px: float) -> tuple[float, float]:
        """Return the highest score, and its x, of the offsets that are not near a column."""
        away = np.flatnonzero(np.abs(self.x - x) > apart_px)
        if not len(away):
            return 0.0, x
        columns = self.score[:, away].max(axis=0)
        return max(0.0, float(columns.max())), float(self.x[away[np.argmax(columns)]])


def correlate(facing: FacingPair, x: Sequence[int], y: Sequence[int]) -> ScoreMap:
    """Correlate two structures at offsets `x`, `y`: consecutive numbers, px of the structures."""
    rows, columns = np.asarray(y), np.asarray(x)
    shape = tuple(
        cv2.getOptimalDFTSize(max(a, b) + int(np.abs(offsets).max()))
        for a, b, offsets in zip(
            facing.left.image.shape, facing.right.image.shape, (rows, columns), strict=True
        )
    )
    spot = np.ix_(rows % shape[0], columns % shape[1])
    (left, left_square, left_seen), (right, right_square, right_seen) = (
        [_spectrum(image, shape) for image in (one.image, one.image * one.image, one.valid)]
        for one in (facing.left, facing.right)
    )
    both, left_energy, right_energy = (
        cv2.dft(cv2.mulSpectrums(a, b, 0, conjB=True), flags=cv2.DFT_INVERSE | cv2.DFT_SCALE)[spot]
        for a, b in ((left, right), (left_square, right_seen), (left_seen, right_square))
    )
    energy = np.sqrt(np.maximum(left_energy, 0) * np.maximum(right_energy, 0))
    return ScoreMap(columns, rows, significance_corrected(both / np.maximum(energy, 1.0), energy))


def significance_corrected(
    correlation: np.ndarray | float, energy: np.ndarray | float
) -> np.ndarray | float:
    """Lower a correlation by what chance may give to so little structure.

    The variance of a structure is about 1 where there is any, so that its energy counts pixels.

    Parameters
    ----------
    correlation
        Of two structures, -1 to 1; one number, or an array of any shape.
    energy
        Sum of the squared structure where both are seen, of the same shape.

    Returns
    -------
    ndarray or float
        Of that shape; below the correlation, the more so the less structure there is.
    """
    return correlation - _DOUBT / np.sqrt(np.maximum(energy, 1.0))


def _spectrum(image, shape):
    padded = np.zeros(shape, np.float32)
    padded[: image.shape[0], : image.shape[1]] = image
    return cv2.dft(padded)
