"""Where a lens sees the points of a sheet: the model that is fitted, with its derivatives."""

import cv2
import numpy as np

from fisheye_geometry.lens import FisheyeLens

INTRINSICS = ('focal_x_px', 'focal_y_px', 'center_x_px', 'center_y_px', 'k1', 'k2', 'k3', 'k4')
UNKNOWNS = (*INTRINSICS, 'warp_xx_mm', 'warp_xy_mm', 'warp_yy_mm')
"""What all views have in common."""

EVEN_POWERS = 2.0 * np.arange(1, 5)


def lens_of(unknowns: np.ndarray, size: tuple[int, int]) -> FisheyeLens:
    """Build the lens for pictures of (width, height)."""
    focal_x, focal_y, center_x, center_y, *distortion = map(float, unknowns[: len(INTRINSICS)])
    return FisheyeLens(*size, focal_x, focal_y, center_x, center_y, tuple(distortion))


def intrinsics_of(lens: FisheyeLens) -> np.ndarray:
    """Return the unknowns (8,) of a lens, in the order of `INTRINSICS`."""
    focal, center = (lens.focal_x_px, lens.focal_y_px), (lens.center_x_px, lens.center_y_px)
    return np.array([*focal, *center, *lens.distortion])


def to_camera(pose: np.ndarray, points_mm: np.ndarray) -> np.ndarray:
    """Points (..., 3) of the target in the camera's frame, for one pose (6,)."""
    return points_mm @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]


def warp_board(points_mm: np.ndarray, board_warp_mm: np.ndarray) -> np.ndarray:
    """Points (M, 3) of a sheet that is not quite flat.

    Paper and board never are, and the lens would be bent to make up for it: 1 mm on a 25 cm sheet
    moved the focal length by 1.5 % (after Strobl and Hirzinger, "More accurate pinhole camera
    calibration with imperfect planar target", 2011, doi 10.1109/ICCVW.2011.6130369).

    Parameters
    ----------
    points_mm
        (M, 3) as they were printed.
    board_warp_mm
        (3,) depth at the outermost points with x^2, x y and y^2.
    """
    warped = points_mm.copy()
    warped[:, 2] += curves(points_mm) @ board_warp_mm
    return warped


def curves(points_mm: np.ndarray) -> np.ndarray:
    """Derivatives (M, 3) of the depths of `warp_board` by the board warp."""
    x, y = (points_mm[:, :2] / np.abs(points_mm[:, :2]).max()).T
    return np.stack([x * x, x * y, y * y], axis=-1)


def pixels_of(unknowns: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the pixels (..., 2) of points (..., 3) alone, as `project` does."""
    x, y, z = np.moveaxis(points, -1, 0)
    side = np.maximum(np.hypot(x, y), 1e-12)
    angle = np.arctan2(side, z)
    square = angle * angle
    k1, k2, k3, k4 = unknowns[4 : len(INTRINSICS)]
    scale = angle * (1 + square * (k1 + square * (k2 + square * (k3 + square * k4)))) / side
    return np.stack([x * scale, y * scale], axis=-1) * unknowns[:2] + unknowns[2:4]


def project(unknowns: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Project points as `FisheyeLens` does, with derivatives and without an end of the field.

    Parameters
    ----------
    unknowns
        (8,) or more float64, in the order of `UNKNOWNS`: four in px, four without unit.
    points
        (N, 3) float64 in the camera's optical frame, mm.

    Returns
    -------
    pixels : ndarray
        (N, 2) float64, px.
    by_intrinsics : ndarray
        (N, 2, 8) float64 derivatives of the pixels, px by the unit of each unknown.
    by_point : ndarray
        (N, 2, 3) float64 derivatives of the pixels, px/mm.
    """
    x, y, z = points.T
    focal, center = unknowns[:2], unknowns[2:4]
    coefficients = unknowns[4 : len(INTRINSICS)]
    side = np.maximum(np.hypot(x, y), 1e-12)
    angle = np.arctan2(side, z)
    powers = angle[:, None] ** EVEN_POWERS
    growth = 1 + powers @ coefficients
    slope = 1 + powers @ (coefficients * (EVEN_POWERS + 1))
    toward = np.stack([x, y], axis=-1) / side[:, None]
    plane = toward * (angle * growth)[:, None]
    by_intrinsics = np.zeros((len(points), 2, len(INTRINSICS)))
    by_intrinsics[:, [0, 1], [0, 1]] = plane
    by_intrinsics[:, [0, 1], [2, 3]] = 1.0
    by_intrinsics[:, :, 4:] = (focal * toward)[..., None] * (angle[:, None] * powers)[:, None]
    # Away from the axis the radius changes by the slope; around it the angle stays.
    squared = side**2 + z**2
    radial = toward[:, :, None] * toward[:, None]
    by_side = (slope * z / squared)[:, None, None] * radial
    by_side += (angle * growth / side)[:, None, None] * (np.eye(2) - radial)
    by_depth = -(slope * side / squared)[:, None] * toward
    by_point = focal[:, None] * np.concatenate([by_side, by_depth[..., None]], axis=-1)
    return plane * focal + center, by_intrinsics, by_point
