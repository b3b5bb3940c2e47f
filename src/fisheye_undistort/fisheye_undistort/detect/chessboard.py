"""Find the corners of a chessboard, first in small copies of a picture, then in larger ones."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np

_PLAIN = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE
_QUICK = _PLAIN + cv2.CALIB_CB_FAST_CHECK
"""Its check throws boards away that a fisheye lens bends: only where more pictures follow."""
_SECTORS = cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_EXHAUSTIVE
_ANY_BOARD = (3, 3)
"""The smallest board that is looked for where the size is not known."""
_LONGEST_ANY_PX = 1280

Finder = Callable[..., tuple[bool, np.ndarray]]


@dataclass(frozen=True)
class _Attempt:
    """A way to look: the longest side of the copy, the finder and its flags."""

    side_px: int
    find: Finder
    flags: int


_QUICK_ATTEMPTS = (
    _Attempt(640, cv2.findChessboardCorners, _PLAIN),
    _Attempt(1280, cv2.findChessboardCorners, _QUICK),
)
_ATTEMPTS = (
    _Attempt(640, cv2.findChessboardCorners, _PLAIN),
    _Attempt(1280, cv2.findChessboardCorners, _PLAIN),
    _Attempt(1280, cv2.findChessboardCornersSB, _SECTORS),
    _Attempt(2560, cv2.findChessboardCorners, _PLAIN),
    _Attempt(2560, cv2.findChessboardCornersSB, _SECTORS),
)


def find_chessboard(
    gray: np.ndarray, rows: int, columns: int, *, quick: bool = False
) -> np.ndarray | None:
    """Find the inner corners of a board.

    Parameters
    ----------
    gray
        (height, width) uint8.
    rows, columns
        Inner corners.
    quick
        Whether a picture may be missed for another that follows.

    Returns
    -------
    ndarray or None
        (rows * columns, 2) px, row after row, good to a few pixels; None if there is no board.
    """
    tried = set()
    for attempt in _QUICK_ATTEMPTS if quick else _ATTEMPTS:
        small, scale = smaller(gray, attempt.side_px)
        if (key := (small.shape, attempt.find, attempt.flags)) in tried:
            continue
        tried.add(key)
        found, corners = attempt.find(small, (columns, rows), flags=attempt.flags)
        if found and len(corners) == rows * columns:
            return from_smaller(corners.reshape(-1, 2), scale)
    return None


def size_of_any_chessboard(gray: np.ndarray) -> tuple[int, int] | None:
    """Return the rows and columns of inner corners of whatever board a picture shows."""
    small, _ = smaller(gray, _LONGEST_ANY_PX)
    found, _, cells = cv2.findChessboardCornersSBWithMeta(
        small, _ANY_BOARD, _SECTORS + cv2.CALIB_CB_LARGER
    )
    return (cells.shape[0], cells.shape[1]) if found else None


def smaller(gray: np.ndarray, side_px: int) -> tuple[np.ndarray, float]:
    """Return a picture whose longer side is `side_px` at most, and how much smaller it is."""
    scale = max(gray.shape) / side_px
    if scale <= 1:
        return gray, 1.0
    size = (round(gray.shape[1] / scale), round(gray.shape[0] / scale))
    return cv2.resize(gray, size, interpolation=cv2.INTER_AREA), gray.shape[1] / size[0]


def from_smaller(corners: np.ndarray, scale: float) -> np.ndarray:
    """Corners in the whole picture; integers are pixel centres."""
    return (corners.astype(float) + 0.5) * scale - 0.5
