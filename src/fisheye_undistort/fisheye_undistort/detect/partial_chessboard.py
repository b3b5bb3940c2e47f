"""Find the part of a chessboard that a picture shows, by the three dots in its squares."""

import cv2
import numpy as np

from fisheye_undistort.detect.chessboard import from_smaller, smaller
from fisheye_undistort.target.target import Target

_FLAGS = cv2.CALIB_CB_NORMALIZE_IMAGE + cv2.CALIB_CB_LARGER + cv2.CALIB_CB_MARKER
_FEWEST = (3, 3)
"""Corners around the three squares with dots."""
_SIDES_PX = (640, 1280)
_DOT = 0.3
"""So much of the next square's grey is in the middle of a square with a dot, blurred or not."""
_RING = 0.5 + 0.33 * np.array([(0, 0), (0, -1), (-1, 0), (0, 1), (1, 0)])
"""Where a square is looked at, in shares of its sides: its middle, and around the dot."""

_NONE = np.empty((0, 2)), np.empty(0, int)


def find_part(
    gray: np.ndarray, target: Target, *, quick: bool = False
) -> tuple[np.ndarray, np.ndarray]:
    """Find those inner corners that a picture shows, if the squares with dots are among them.

    Parameters
    ----------
    gray
        (height, width) uint8.
    target
        A chessboard.
    quick
        Whether a picture may be missed for another that follows.

    Returns
    -------
    corners : ndarray
        (N, 2) px, good to a few pixels.
    ids : ndarray
        (N,) their numbers on the board. N is 0 if there is no such part.
    """
    best = _NONE
    for side in _SIDES_PX[:1] if quick else _SIDES_PX:
        small, scale = smaller(gray, side)
        found, corners, cells = cv2.findChessboardCornersSBWithMeta(small, _FEWEST, _FLAGS)
        if found:
            grid = corners.reshape(*cells.shape, 2)
            part = _placed(grid, _dots(small, grid), target, small.shape)
            part = from_smaller(part[0], scale), part[1]
            best = max(best, part, key=lambda found: len(found[1]))
        if scale <= 1:
            break
    return best


def _dots(gray: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Mark the squares (n - 1, m - 1) between corners (n, m, 2) that have a dot.

    OpenCV sees dots as well where a chessboard without any is bent or lit unevenly.
    """
    y, x = _RING.T[:, :, None, None, None]
    top = grid[:-1, :-1] * (1 - x) + grid[:-1, 1:] * x
    bottom = grid[1:, :-1] * (1 - x) + grid[1:, 1:] * x
    places = (top * (1 - y) + bottom * y).reshape(len(_RING), -1, 2).astype(np.float32)
    levels = cv2.remap(gray, places, None, cv2.INTER_LINEAR).astype(float)
    middle, *around = levels.reshape(len(_RING), *(size - 1 for size in grid.shape[:2]))
    square = np.mean(around, axis=0)
    beside = np.concatenate([square[:, 1:2], square[:, :-1]], axis=1)
    return (middle - square) * np.sign(beside - square) > _DOT * np.abs(beside - square)


def _placed(grid: np.ndarray, dots: np.ndarray, target: Target, shape: tuple[int, ...]):
    """Number corners (n, m, 2) by where the squares with dots (n - 1, m - 1) are."""
    across, down = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if across[0] * down[1] < across[1] * down[0]:  # mirrored, as no camera sees it
        grid, dots = grid.swapaxes(0, 1), dots.T
    squares = np.array(target.dotted_squares)
    pattern = squares - squares.min(axis=0)
    for _ in range(4):
        found = np.argwhere(dots)
        if len(found) == len(pattern) and np.array_equal(found - found.min(axis=0), pattern):
            # The square of row 1 and column 1 has the first inner corner at its upper left.
            return _numbered(grid, squares[0] - 1 - found[0], target, shape)
        grid, dots = np.rot90(grid), np.rot90(dots)
    return _NONE


def _numbered(grid: np.ndarray, first: np.ndarray, target: Target, shape: tuple[int, ...]):
    """Number corners (n, m, 2) from the row and column of the first.

    The others must be beyond the edges of the picture, or the board is of another size.
    """
    last = first + grid.shape[:2]
    missing = np.concatenate([first, (target.rows, target.columns) - last])
    sides = grid, grid.swapaxes(0, 1), grid[::-1], grid.swapaxes(0, 1)[::-1]
    # The last squares before the edge may be missed.
    beyond = [side[0] + 2 * (side[0] - side[1]) for side in sides]
    cut = [np.any((line < 0) | (line >= shape[::-1])) for line in beyond]
    if missing.min() < 0 or not np.all(cut, where=missing > 0):
        return _NONE
    rows, columns = np.mgrid[first[0] : last[0], first[1] : last[1]]
    # OpenCV guesses some corners from their neighbours.
    seen = np.all((grid >= 0) & (grid <= np.array(shape[::-1]) - 1), axis=-1)
    return grid[seen], (rows * target.columns + columns)[seen]
