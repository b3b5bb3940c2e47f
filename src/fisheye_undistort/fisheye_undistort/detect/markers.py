"""Find the corners of boards with markers: ChArUco, and the AprilTag grid of Kalibr."""

import cv2
import numpy as np

from fisheye_undistort.detect.chessboard import smaller
from fisheye_undistort.target.marker_dictionary import dictionary_named, dictionary_names
from fisheye_undistort.target.target import Target

_SIDES_PX = (1280, 2560, 100_000)
"""Longest sides of the copies in which markers are looked for."""
_MAX_ENLARGED = 2.0
"""Small pictures are enlarged up to so much: the cells of a marker may be two pixels wide."""
_GRID_BORDER = 2
"""Black cells around the code of Kalibr's tags; OpenCV's own markers have one."""
_GAPS_PX = (3, 5, 9, 0)
"""White is grown by so much, that the squares between Kalibr's tags let go of their corners."""
_MOST_FOREIGN = 0.2
"""Share of markers that a board does not have, from which on it is another board."""
_FEWEST_MARKERS = 4
"""Markers of one dictionary that are no accident."""

Corners = tuple[np.ndarray, np.ndarray]
_NONE: Corners = np.empty((0, 2)), np.empty(0, int)


def find_charuco(gray: np.ndarray, target: Target) -> Corners:
    """Find inner corners of a ChArUco board: pixels (N, 2) and ids (N,)."""
    best = _NONE
    for side in _SIDES_PX:
        small, scale = _copy(gray, side)
        found = _charuco(small, target)
        if len(found[1]) > len(best[1]):
            best = (found[0] + 0.5) * scale - 0.5, found[1]
        if scale <= 1 or len(best[1]) == len(target.cells):
            break
    return best


def _copy(gray: np.ndarray, side_px: int) -> tuple[np.ndarray, float]:
    """Return a copy whose longer side is about `side_px`, and how much smaller it is."""
    larger = min(_MAX_ENLARGED, side_px / max(gray.shape))
    if larger <= 1 or side_px > _SIDES_PX[0]:
        return smaller(gray, side_px)
    size = (round(gray.shape[1] * larger), round(gray.shape[0] * larger))
    return cv2.resize(gray, size, interpolation=cv2.INTER_CUBIC), gray.shape[1] / size[0]


def _charuco(gray: np.ndarray, target: Target) -> Corners:
    dictionary = dictionary_named(target.dictionary)
    if not hasattr(cv2.aruco, 'CharucoDetector'):
        return _charuco_before_47(gray, target, dictionary)
    size = (target.columns, target.rows)
    board = cv2.aruco.CharucoBoard(size, target.dx_mm, target.marker_mm, dictionary)
    if hasattr(board, 'setLegacyPattern'):  # from OpenCV 4.8 on
        board.setLegacyPattern(target.legacy)
    corners, ids, _, _ = cv2.aruco.CharucoDetector(board).detectBoard(gray)
    return _NONE if ids is None else (corners.reshape(-1, 2).astype(float), ids.ravel())


def _charuco_before_47(gray: np.ndarray, target: Target, dictionary) -> Corners:
    """Do what OpenCV's CharucoDetector does from 4.7 on."""
    # The legacy layout of even rows is today's with one row more above.
    above = int(target.legacy and target.rows % 2 == 0)
    columns, rows = target.columns, target.rows + above
    board = cv2.aruco.CharucoBoard_create(
        columns, rows, target.dx_mm, target.marker_mm, dictionary
    )
    markers, ids, _ = cv2.aruco.detectMarkers(gray, dictionary)
    if ids is None:
        return _NONE
    ids = ids + np.int32(above * (columns // 2))
    if np.mean(ids >= rows * columns // 2) > _MOST_FOREIGN:
        return _NONE
    _, corners, ids = cv2.aruco.interpolateCornersCharuco(markers, ids, gray, board)
    if ids is None:
        return _NONE
    ids = ids.ravel() - above * (columns - 1)
    return corners.reshape(-1, 2)[ids >= 0].astype(float), ids[ids >= 0]


def find_aprilgrid(gray: np.ndarray, target: Target) -> Corners:
    """Find corners of the tags of Kalibr's grid: pixels (N, 2) and ids (N,)."""
    tags: dict[int, np.ndarray] = {}
    for side in _SIDES_PX:
        small, scale = _copy(gray, side)
        for gap in _GAPS_PX:
            grown = cv2.dilate(small, np.ones((gap, gap), np.uint8)) if gap else small
            found, ids = _markers(grown, target.dictionary, _GRID_BORDER)
            for tag, corners in zip(ids, found, strict=True):
                if tag < target.rows * target.columns:
                    tags.setdefault(int(tag), (corners + 0.5) * scale - 0.5)
        if scale <= 1 or len(tags) == target.rows * target.columns:
            break
    return _in_grid(tags, target) if len(tags) > 1 else _NONE


def _in_grid(tags: dict[int, np.ndarray], target: Target) -> Corners:
    """Return the corners of tags with their ids.

    Which corner of a tag is its first is not the same everywhere; where the neighbours lie tells.
    """
    place = {tag: (target.rows - 1 - tag // target.columns, tag % target.columns) for tag in tags}
    middle = {tag: corners.mean(axis=0) for tag, corners in tags.items()}
    along = np.zeros(4)
    for tag, (row, column) in place.items():
        for other, (other_row, other_column) in place.items():
            step = other_column - column, other_row - row
            if abs(step[0]) + abs(step[1]) != 1:
                continue
            direction = middle[other] - middle[tag]
            direction = direction / np.linalg.norm(direction)
            for turn in range(4):
                corners = np.roll(tags[tag], turn, axis=0)
                right, down = corners[1] - corners[0], corners[3] - corners[0]
                axis = step[0] * right + step[1] * down
                along[turn] += axis @ direction / np.linalg.norm(axis)
    if not along.any():
        return _NONE
    turn = int(np.argmax(along))
    pixels, ids = [], []
    width = 2 * target.columns
    for tag, (row, column) in place.items():
        first = 2 * row * width + 2 * column
        pixels.append(np.roll(tags[tag], turn, axis=0))
        ids.append([first, first + 1, first + width + 1, first + width])
    order = np.argsort(np.concatenate(ids))
    return np.concatenate(pixels)[order], np.concatenate(ids)[order]


def dictionary_in(gray: np.ndarray) -> str | None:
    """Return the name of the dictionary of most markers in a picture; None if there are few."""
    small, _ = smaller(gray, _SIDES_PX[0])
    # Of the same markers the largest dictionary is as good as the smaller ones it begins with.
    counts = [
        (len(_markers(small, name, 1)[1]), len(dictionary_named(name).bytesList), name)
        for name in dictionary_names()
    ]
    count, _, name = max(counts, default=(0, 0, ''))
    return name if count >= _FEWEST_MARKERS else None


def _markers(gray: np.ndarray, dictionary_name: str, border: int) -> tuple[np.ndarray, np.ndarray]:
    """Corners (N, 4, 2) and ids (N,) of markers."""
    dictionary = dictionary_named(dictionary_name)
    if hasattr(cv2.aruco, 'ArucoDetector'):
        parameters = cv2.aruco.DetectorParameters()
        parameters.markerBorderBits = border
        found, ids, _ = cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(gray)
    else:
        parameters = cv2.aruco.DetectorParameters_create()
        parameters.markerBorderBits = border
        found, ids, _ = cv2.aruco.detectMarkers(gray, dictionary, parameters=parameters)
    if ids is None:
        return np.empty((0, 4, 2)), np.empty(0, int)
    return np.array(found, float).reshape(-1, 4, 2), ids.ravel()
