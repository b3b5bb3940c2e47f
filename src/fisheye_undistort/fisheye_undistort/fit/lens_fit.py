"""Least squares over a lens, the warp of the board and its poses, with analytic derivatives."""

import cv2
import numpy as np

from fisheye_undistort.fit.bundle_adjustment import POSE, NormalEquations, minimize
from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.lens_prior import Prior
from fisheye_undistort.fit.sheet_model import (
    INTRINSICS,
    UNKNOWNS,
    curves,
    pixels_of,
    project,
    warp_board,
)


def _alone(*names: str) -> np.ndarray:
    """Directions (len(names), len(UNKNOWNS)) along which each changes without the others."""
    return np.array([np.eye(len(UNKNOWNS))[UNKNOWNS.index(name)] for name in names]).reshape(
        -1, len(UNKNOWNS)
    )


GROUPS = {
    'focal length': _alone('focal_x_px') + _alone('focal_y_px'),
    'principal point': _alone('center_x_px', 'center_y_px'),
    'k1': _alone('k1'),
    'k2': _alone('k2'),
    'k3': _alone('k3'),
    'k4': _alone('k4'),
    'aspect ratio': _alone('focal_y_px'),
    'board warp': _alone('warp_xx_mm', 'warp_xy_mm', 'warp_yy_mm'),
}
"""What is fitted together or left as it is: directions in the space of the unknowns."""

_OUTLIER_PX = 1.0
"""Beyond this a residual counts linearly: one wrong point must not pull the lens."""


def fit(
    views: list[TargetView],
    points_mm: np.ndarray,
    start: Estimate,
    nominal: np.ndarray,
    free: tuple[str, ...],
    bias_px: list[np.ndarray] | None = None,
    prior: Prior | None = None,
    tolerance: float = 1e-8,
) -> Estimate:
    """Fit the free unknowns and every pose.

    Parameters
    ----------
    views
        What was seen.
    points_mm
        (M, 3) of the target.
    start
        Unknowns and poses to begin with.
    nominal
        (11,) unknowns; those that are not free have these values.
    free
        Names of `GROUPS`.
    bias_px
        One (N, 2) array for each view, added to what is predicted for each point.
    prior
        What is known of the unknowns before anything is seen; None: nothing.
    tolerance
        Relative change of the cost at which to stop.
    """
    problem = FitProblem(views, points_mm, nominal, free, bias_px, prior)
    vector = minimize(problem.normal_equations, problem.cost, problem.pack(start), tolerance)
    unknowns, poses = problem.unpack(vector)
    residuals = problem.residuals_px(vector)
    return Estimate(
        unknowns,
        poses,
        residuals_px=tuple(-part for part in np.split(residuals, problem.splits)),
        covariance=problem.covariance(vector),
        cost=float(np.sum(damp(residuals)[0] ** 2)),
        free=free,
    )


class FitProblem:
    """Residuals and their derivatives as functions of one vector: free unknowns, then poses."""

    def __init__(self, views, points_mm, nominal, free, bias_px=None, prior=None):
        counts = [len(view.ids) for view in views]
        self.splits = np.cumsum(counts)[:-1]
        self._view = np.repeat(np.arange(len(views)), counts)
        self._ids = np.concatenate([view.ids for view in views])
        self._points = points_mm
        self._found = np.concatenate([view.points_px for view in views])
        if bias_px is not None:
            self._found = self._found - np.concatenate(bias_px)
        self._basis = np.concatenate([_alone(), *(GROUPS[name] for name in free)]).T
        self._nominal = nominal
        self._prior = prior or Prior.none()

    def pack(self, estimate):
        """Return the vector whose unknowns are nearest to those of an estimate."""
        change = estimate.unknowns - self._nominal
        free = np.linalg.lstsq(self._basis, change, rcond=None)[0]
        return np.concatenate([free, estimate.poses.ravel()])

    def unpack(self, vector):
        """Unknowns (11,) and poses (V, 6)."""
        count = self._basis.shape[1]
        return self._nominal + self._basis @ vector[:count], vector[count:].reshape(-1, POSE)

    def residuals_px(self, vector):
        """Predicted minus found, (N, 2)."""
        unknowns, poses = self.unpack(vector)
        rotations = np.array([cv2.Rodrigues(pose[:3])[0] for pose in poses])
        points = self._sheet(unknowns)[:, None] @ rotations[self._view].transpose(0, 2, 1)
        return pixels_of(unknowns, points[:, 0] + poses[self._view, 3:]) - self._found

    def cost(self, vector):
        """Sum of the squared residuals, robust, and of what the prior adds."""
        residuals, _ = damp(self.residuals_px(vector))
        cost = np.sum(residuals**2) + np.sum(self._prior.residuals(self.unpack(vector)[0]) ** 2)
        return float(cost) if np.isfinite(cost) else np.inf

    def jacobian(self, vector):
        """Residuals (N, 2), damped so that the sum of their squares is a robust cost.

        Returns
        -------
        residuals : ndarray
            (N, 2) px.
        by_shared : ndarray
            (N, 2, S) derivatives by the free unknowns.
        by_pose : ndarray
            (N, 2, 6) derivatives by the pose of the point's view.
        """
        unknowns, poses = self.unpack(vector)
        points, by_turn, by_warp = self._to_camera(unknowns, poses)
        pixels, by_intrinsics, by_point = project(unknowns, points)
        residuals, slopes = damp(pixels - self._found)
        by_unknowns = np.concatenate([by_intrinsics, by_point @ by_warp], axis=-1)
        by_pose = np.concatenate([by_point @ by_turn, by_point], axis=-1)
        slopes = slopes[..., None]
        return residuals, slopes * (by_unknowns @ self._basis), slopes * by_pose

    def normal_equations(self, vector):
        """Return the blocks of the normal equations at a vector."""
        residuals, by_shared, by_pose = self.jacobian(vector)
        count = by_shared.shape[2]
        whole = np.concatenate([by_shared, by_pose, residuals[..., None]], axis=-1)
        rows = [view.reshape(-1, whole.shape[2]) for view in np.split(whole, self.splits)]
        blocks = np.array([view.T @ view for view in rows])
        known = self._prior.residuals(self.unpack(vector)[0])
        by_known = self._prior.root @ self._basis
        return NormalEquations(
            cost=float(blocks[:, -1, -1].sum() + known @ known),
            shared=blocks[:, :count, :count],
            cross=blocks[:, :count, count:-1],
            poses=blocks[:, count:-1, count:-1],
            shared_slopes=blocks[:, :count, -1],
            pose_slopes=blocks[:, count:-1, -1],
            known=by_known.T @ by_known,
            known_slope=by_known.T @ known,
        )

    def _sheet(self, unknowns):
        """Points (N, 3) on the sheet."""
        return warp_board(self._points, unknowns[len(INTRINSICS) :])[self._ids]

    def _to_camera(self, unknowns, poses):
        """Points (N, 3) in the camera's frame, derivatives (N, 3, 3) by turn and warp."""
        pairs = [cv2.Rodrigues(pose[:3]) for pose in poses]
        rotation = np.array([matrix for matrix, _ in pairs])[self._view]
        slopes = np.array([slope.reshape(3, 3, 3) for _, slope in pairs])[self._view]
        sheet = self._sheet(unknowns)
        points = (rotation @ sheet[..., None])[..., 0] + poses[self._view, 3:]
        by_turn = (slopes @ sheet[:, None, :, None])[..., 0].transpose(0, 2, 1)
        return points, by_turn, rotation[:, :, 2:] * curves(self._points)[self._ids, None]

    def covariance(self, vector):
        """Covariance (11, 11) of the unknowns; 0 for what is not free."""
        normal = self.normal_equations(vector)
        excess = max(2 * len(self._found) - len(vector), 1)
        return self._basis @ normal.covariance(normal.cost / excess) @ self._basis.T


def damp(residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pseudo-Huber: values whose squares grow linearly beyond `_OUTLIER_PX`, and their slopes."""
    root = np.sqrt(1 + (residuals / _OUTLIER_PX) ** 2)
    # residuals^2 / (root + 1) is 2 (root - 1) without the cancellation near 0.
    shrink = np.sqrt(2 / (root + 1))
    return residuals * shrink, 1 / (root * shrink)
