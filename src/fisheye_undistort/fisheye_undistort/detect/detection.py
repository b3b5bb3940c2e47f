"""Find a calibration target in a picture, whatever its kind."""

from dataclasses import dataclass

import cv2
import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.chessboard import find_chessboard
from fisheye_undistort.detect.circle_grid import area_bands, find_circles
from fisheye_undistort.detect.grid_order import GridNotFoundError, order_grid
from fisheye_undistort.detect.markers import find_aprilgrid, find_charuco
from fisheye_undistort.detect.partial_chessboard import find_part
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.target.target import Target

_MIN_CORNERS = 8
"""Fewer corners of a board with markers hold a pose, but hardly anything about the lens."""
_REFINED_SHARE = 0.35
"""Half size of the window that places a corner, in distances to the next one, ..."""
_REFINED_MARGIN = 0.9
"""... and in distances to the marker in the square, which must not be in it."""
_REFINED_PX = (2, 15)
_REFINED_SIDES = 1 / 100
"""Likewise at most, in sides of the picture: what was found in a smaller copy is off by more."""
_MOST_MOVED = 0.03
"""Corners of a part that move farther, in distances to the next one, were drawn to an edge of the
picture, which is as sharp as that of a square."""
_REFINED_UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 0.005)


@dataclass(frozen=True)
class Detector:
    """Finds a target.

    Attributes
    ----------
    target
        What was printed.
    min_area_px, max_area_px
        Limits of the particle filter of `find_circles`; 0: several are tried.
    quick
        Whether a picture may be missed for another that follows.
    """

    target: Target
    min_area_px: float = 0.0
    max_area_px: float = 0.0
    quick: bool = False

    def __call__(self, name: str, gray: np.ndarray) -> TargetView:
        """Find the target's points.

        Parameters
        ----------
        name
            Of the picture.
        gray
            (height, width) uint8.

        Raises
        ------
        CalibrationError
            Where the picture does not show the target; the sentence says what it shows.
        """
        points, ids = _FINDERS[self.target.kind](self, gray)
        return TargetView(name, points, ids)


def _circles(detector: Detector, gray: np.ndarray):
    target = detector.target
    reasons = []
    for low, high in area_bands(gray.shape, detector.min_area_px, detector.max_area_px):
        try:
            return order_grid(find_circles(gray, low, high), target)
        except GridNotFoundError as error:
            reasons.append(error)
    raise max(reasons, key=lambda error: error.circles)


def _chessboard(detector: Detector, gray: np.ndarray):
    target = detector.target
    corners = find_chessboard(gray, target.rows, target.columns, quick=detector.quick)
    ids = np.arange(len(target.cells))
    if corners is not None:
        return _refine(gray, corners, ids, target), ids
    corners, ids = find_part(gray, target, quick=detector.quick)
    if len(ids):
        refined = _refine(gray, corners, ids, target)
        moved = np.linalg.norm(refined - corners, axis=-1)
        kept = moved < _MOST_MOVED * _nearest(corners, ids, target)
        corners, ids = refined[kept], ids[kept]
    if len(ids) < _MIN_CORNERS:
        raise CalibrationError(
            f'no chessboard of {target.rows} x {target.columns} inner corners (rows x columns)'
        )
    return corners, ids


def _charuco(detector: Detector, gray: np.ndarray):
    target = detector.target
    corners, ids = find_charuco(gray, target)
    if len(ids) < _MIN_CORNERS:
        raise CalibrationError(
            f'{len(ids)} corners of a ChArUco board of {target.rows} x {target.columns} squares '
            f'(rows x columns, {target.dictionary}); expected at least {_MIN_CORNERS}'
        )
    return _refine(gray, corners, ids, target), ids


def _aprilgrid(detector: Detector, gray: np.ndarray):
    target = detector.target
    corners, ids = find_aprilgrid(gray, target)
    if len(ids) < _MIN_CORNERS:
        raise CalibrationError(
            f'{len(ids) // 4} tags of an AprilTag grid of {target.rows} x {target.columns} '
            f'(rows x columns, 36h11); expected at least {_MIN_CORNERS // 4}'
        )
    return _refine(gray, corners, ids, target), ids


_FINDERS = {
    'circles': _circles,
    'acircles': _circles,
    'chessboard': _chessboard,
    'charuco': _charuco,
    'aprilgrid': _aprilgrid,
}


def _refine(gray: np.ndarray, corners: np.ndarray, ids: np.ndarray, target: Target) -> np.ndarray:
    """Place corners (N, 2) to a fraction of a pixel, each within its own squares."""
    nearest = _nearest(corners, ids, target)
    share = _REFINED_SHARE
    if target.kind == 'charuco':
        share = min(share, _REFINED_MARGIN * (1 - target.marker_mm / target.dx_mm) / 2)
    largest = max(_REFINED_PX[1], _REFINED_SIDES * max(gray.shape))
    halves = (share * nearest).clip(_REFINED_PX[0], largest).astype(int)
    refined = np.empty((len(corners), 2))
    for half in np.unique(halves):
        some = halves == half
        start = corners[some].astype(np.float32).reshape(-1, 1, 2)
        refined[some] = cv2.cornerSubPix(
            gray, start, (int(half), int(half)), (-1, -1), _REFINED_UNTIL
        )[:, 0]
    return refined


def _nearest(corners: np.ndarray, ids: np.ndarray, target: Target) -> np.ndarray:
    """Distance (N,) from corners (N, 2) to the nearest one that is printed next to them, px."""
    cells, places_mm = target.cells[ids], target.points_mm[ids]
    neighbours = np.abs(cells[:, None] - cells).sum(axis=-1) == 1
    distances = np.linalg.norm(corners[:, None] - corners, axis=-1)
    apart_mm = np.linalg.norm(places_mm[:, None] - places_mm, axis=-1)
    np.divide(distances, apart_mm, out=distances, where=neighbours)
    return target.gap_mm * np.where(neighbours, distances, np.inf).min(axis=1)
