"""Start of the fit: a lens without distortion and, for it, the pose of every view."""

import cv2
import numpy as np

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.sheet_model import UNKNOWNS, lens_of, pixels_of, to_camera

_FOCAL_SCAN = np.geomspace(0.4, 4.0, 15)
"""Starts tried, in shares of width / pi: from a circle in the middle to a narrow lens."""
_ENOUGH_VIEWS = 30
"""More do not tell a good start better."""


def first_guess(views: list[TargetView], points_mm: np.ndarray, size: tuple[int, int]) -> Estimate:
    """Try lenses without distortion around focal length = width / pi, the axis in the middle.

    Parameters
    ----------
    views
        What was seen.
    points_mm
        (M, 3) of the target.
    size
        Width and height of the pictures, px.
    """
    width, height = size
    candidates = []
    some = views[:: -(-len(views) // _ENOUGH_VIEWS)]
    for focal in _FOCAL_SCAN * width / np.pi:
        unknowns = np.zeros(len(UNKNOWNS))
        unknowns[:4] = focal, focal, (width - 1) / 2, (height - 1) / 2
        residuals = [
            np.linalg.norm(
                pixels_of(unknowns, to_camera(pose, points_mm[view.ids])) - view.points_px,
                axis=-1,
            ).mean()
            for pose, view in zip(_poses(some, points_mm, unknowns, size), some, strict=True)
        ]
        candidates.append((float(np.median(residuals)), focal, unknowns))
    _, _, best = min(candidates)
    return Estimate(best, _poses(views, points_mm, best, size))


def _poses(views, points_mm, unknowns, size) -> np.ndarray:
    """Pose (V, 6) of each view before one lens."""
    lens = lens_of(unknowns, size)
    return np.array([_pose(view, points_mm, lens) for view in views])


def _pose(view: TargetView, points_mm: np.ndarray, lens: FisheyeLens) -> np.ndarray:
    """Pose (6,) from the homography between the sheet and rays, which may lie behind the plane."""
    rays, _ = lens.unproject(view.points_px)
    scale = np.abs(points_mm[:, :2]).max()
    flat = np.concatenate([points_mm[view.ids, :2] / scale, np.ones((len(rays), 1))], axis=-1)
    # Each ray must be parallel to H x: its cross product with that is 0, linear in H.
    equations = np.einsum('nij,nk->nijk', _cross(rays), flat).reshape(-1, 9)
    homography = np.linalg.svd(equations, full_matrices=False)[2][-1].reshape(3, 3)
    if np.sum(rays * (flat @ homography.T)) < 0:
        homography = -homography
    homography /= np.linalg.norm(homography[:, :2]) / np.sqrt(2)
    u, _, v = np.linalg.svd(homography[:, :2], full_matrices=False)
    first, second = (u @ v).T
    rotation = np.stack([first, second, np.cross(first, second)], axis=-1)
    return np.concatenate([cv2.Rodrigues(rotation)[0].ravel(), homography[:, 2] * scale])


def _cross(rays: np.ndarray) -> np.ndarray:
    """Matrices (N, 3, 3) of the cross product with rays (N, 3)."""
    x, y, z = rays.T
    zero = np.zeros_like(x)
    return np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(-1, 3, 3)
