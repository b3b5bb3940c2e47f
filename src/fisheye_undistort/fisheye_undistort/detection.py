"""Find a calibration target in a picture, whatever its kind."""

from dataclasses import dataclass

import cv2
import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_undistort.circle_grid import find_circles
from fisheye_undistort.estimate import TargetView
from fisheye_undistort.grid_order import order_grid
from fisheye_undistort.target import MARKERS, Target, marker_dictionary

_MIN_CORNERS = 8
"""Fewer corners of a ChArUco board hold a pose, but hardly anything about the lens."""
_REFINED_SHARE = 0.35
"""Half size of the window that places a corner, in distances to the next one, ..."""
_REFINED_MARGIN = 0.9
"""... and in distances to the marker in the square, which must not be in it."""
_REFINED_PX = (2, 15)
_REFINED_UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 0.005)


@dataclass(frozen=True)
class Detector:
    """Finds a target; the limits of the particle filter are those of `find_circles`."""

    target: Target
    min_area_px: float = 0.0
    max_area_px: float = 0.0

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
        if self.target.has_circles:
            circles = find_circles(gray, self.min_area_px, self.max_area_px)
            points, ids = order_grid(circles, self.target)
        elif self.target.kind == 'chessboard':
            points, ids = _chessboard(gray, self.target)
        else:
            points, ids = _charuco(gray, self.target)
        return TargetView(name, points, ids)


def _chessboard(gray: np.ndarray, target: Target):
    found, corners = cv2.findChessboardCorners(
        gray,
        (target.columns, target.rows),
        flags=cv2.CALIB_CB_ADAPTIVE_THRESH
        + cv2.CALIB_CB_NORMALIZE_IMAGE
        + cv2.CALIB_CB_FAST_CHECK,
    )
    if not found:
        raise CalibrationError(
            f'no chessboard of {target.rows} x {target.columns} inner corners (rows x columns)'
        )
    ids = np.arange(len(target.cells))
    return _refine(gray, corners.reshape(-1, 2), ids, target), ids


def _charuco(gray: np.ndarray, target: Target):
    dictionary = marker_dictionary()
    if hasattr(cv2.aruco, 'CharucoDetector'):
        board = cv2.aruco.CharucoBoard(
            (target.columns, target.rows), target.dx_mm, target.marker_mm, dictionary
        )
        corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(gray)
    else:  # before OpenCV 4.7
        board = cv2.aruco.CharucoBoard_create(
            target.columns, target.rows, target.dx_mm, target.marker_mm, dictionary
        )
        markers, marker_ids, _ = cv2.aruco.detectMarkers(gray, dictionary)
        corners, ids = None, None
        if markers:
            _, corners, ids = cv2.aruco.interpolateCornersCharuco(markers, marker_ids, gray, board)
    found = 0 if ids is None else len(ids)
    if found < _MIN_CORNERS:
        raise CalibrationError(
            f'{found} corners of a ChArUco board of {target.rows} x {target.columns} squares '
            f'(rows x columns, {MARKERS}); expected at least {_MIN_CORNERS}'
        )
    ids = ids.ravel()
    return _refine(gray, corners.reshape(-1, 2), ids, target), ids


def _refine(gray: np.ndarray, corners: np.ndarray, ids: np.ndarray, target: Target) -> np.ndarray:
    """Place corners (N, 2) to a fraction of a pixel, each within its own squares."""
    cells = target.cells[ids]
    neighbours = np.abs(cells[:, None] - cells).sum(axis=-1) == 1
    distances = np.linalg.norm(corners[:, None] - corners, axis=-1)
    nearest = np.where(neighbours, distances, np.inf).min(axis=1)
    share = _REFINED_SHARE
    if target.kind == 'charuco':
        share = min(share, _REFINED_MARGIN * (1 - target.marker_mm / target.dx_mm) / 2)
    halves = (share * nearest).clip(*_REFINED_PX).astype(int)
    refined = np.empty((len(corners), 2))
    for half in np.unique(halves):
        some = halves == half
        start = corners[some].astype(np.float32).reshape(-1, 1, 2)
        refined[some] = cv2.cornerSubPix(
            gray, start, (int(half), int(half)), (-1, -1), _REFINED_UNTIL
        )[:, 0]
    return refined
