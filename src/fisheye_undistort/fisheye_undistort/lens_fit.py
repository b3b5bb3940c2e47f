"""Least squares over a lens, the warp of the board and its poses, with analytic derivatives."""

import cv2
import numpy as np
from scipy.optimize import least_squares

from fisheye_undistort.estimate import Estimate, TargetView
from fisheye_undistort.sheet_model import INTRINSICS, UNKNOWNS, curves, project, warp_board


def _alone(*names: str) -> np.ndarray:
    """Directions (len(names), len(UNKNOWNS)) along which each changes without the others."""
    return np.eye(len(UNKNOWNS))[[UNKNOWNS.index(name) for name in names]]


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

_POSE = 6
_OUTLIER_PX = 1.0
"""Beyond this a residual counts linearly: one wrong point must not pull the lens."""
_MAX_EVALUATIONS = 100
_UNDETERMINED = 1e-12
"""Added to the scaled normal equations: what no point tells gets a huge deviation."""


def fit(
    views: list[TargetView],
    points_mm: np.ndarray,
    start: Estimate,
    nominal: np.ndarray,
    free: tuple[str, ...],
    bias_px: list[np.ndarray] | None = None,
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
    tolerance
        Relative change of the cost at which to stop.
    """
    problem = FitProblem(views, points_mm, nominal, free, bias_px)
    solution = least_squares(
        problem.residuals,
        problem.pack(start),
        problem.jacobian,
        method='lm',
        x_scale='jac',
        ftol=tolerance,
        max_nfev=_MAX_EVALUATIONS,
    )
    unknowns, poses = problem.unpack(solution.x)
    residuals = problem.residuals_px(solution.x)
    return Estimate(
        unknowns,
        poses,
        residuals_px=tuple(-part for part in np.split(residuals, problem.splits)),
        covariance=problem.covariance(solution),
        cost=2 * solution.cost,
        free=free,
    )


class FitProblem:
    """Residuals and their derivatives as functions of one vector: free unknowns, then poses."""

    def __init__(self, views, points_mm, nominal, free, bias_px):
        counts = [len(view.ids) for view in views]
        self.splits = np.cumsum(counts)[:-1]
        self._view = np.repeat(np.arange(len(views)), counts)
        self._ids = np.concatenate([view.ids for view in views])
        self._points = points_mm
        self._found = np.concatenate([view.points_px for view in views])
        if bias_px is not None:
            self._found = self._found - np.concatenate(bias_px)
        self._basis = np.concatenate([GROUPS[name] for name in free]).T
        self._nominal = nominal

    def pack(self, estimate):
        """Return the vector whose unknowns are nearest to those of an estimate."""
        change = estimate.unknowns - self._nominal
        free = np.linalg.lstsq(self._basis, change, rcond=None)[0]
        return np.concatenate([free, estimate.poses.ravel()])

    def unpack(self, vector):
        """Unknowns (11,) and poses (V, 6)."""
        count = self._basis.shape[1]
        return self._nominal + self._basis @ vector[:count], vector[count:].reshape(-1, _POSE)

    def residuals_px(self, vector):
        """Predicted minus found, (N, 2)."""
        unknowns, poses = self.unpack(vector)
        points, _, _ = self._to_camera(unknowns, poses)
        return project(unknowns, points)[0] - self._found

    def residuals(self, vector):
        """Residuals (2 N,) px, damped so that the sum of their squares is a robust cost."""
        return damp(self.residuals_px(vector))[0].ravel()

    def jacobian(self, vector):
        """Derivatives of `residuals`, (2 N, len(vector))."""
        unknowns, poses = self.unpack(vector)
        points, by_turn, by_warp = self._to_camera(unknowns, poses)
        pixels, by_intrinsics, by_point = project(unknowns, points)
        by_unknowns = np.concatenate([by_intrinsics, by_point @ by_warp], axis=-1)
        count = self._basis.shape[1]
        jacobian = np.zeros((len(points), 2, len(vector)))
        jacobian[:, :, :count] = by_unknowns @ self._basis
        by_pose = np.concatenate([by_point @ by_turn, by_point], axis=-1)
        columns = count + _POSE * self._view[:, None] + np.arange(_POSE)
        np.put_along_axis(jacobian, columns[:, None, :].repeat(2, axis=1), by_pose, axis=-1)
        jacobian *= damp(pixels - self._found)[1][..., None]
        return jacobian.reshape(-1, len(vector))

    def _to_camera(self, unknowns, poses):
        """Points (N, 3) in the camera's frame, derivatives (N, 3, 3) by turn and warp."""
        pairs = [cv2.Rodrigues(pose[:3]) for pose in poses]
        rotation = np.array([matrix for matrix, _ in pairs])[self._view]
        slopes = np.array([slope.reshape(3, 3, 3) for _, slope in pairs])[self._view]
        sheet = warp_board(self._points, unknowns[len(INTRINSICS) :])[self._ids]
        points = np.einsum('nij,nj->ni', rotation, sheet) + poses[self._view, 3:]
        by_turn = np.einsum('nkij,nj->nik', slopes, sheet)
        return points, by_turn, rotation[:, :, 2:] * curves(self._points)[self._ids, None]

    def covariance(self, solution):
        """Covariance (11, 11), from the Jacobian and the scatter of the residuals."""
        scale = np.linalg.norm(solution.jac, axis=0)
        scale[scale == 0] = 1.0
        information = (solution.jac / scale).T @ (solution.jac / scale)
        inverse = np.linalg.inv(information + _UNDETERMINED * np.eye(len(scale)))
        excess = max(len(solution.fun) - len(solution.x), 1)
        free = slice(self._basis.shape[1])
        covariance = 2 * solution.cost / excess * (inverse / scale / scale[:, None])[free, free]
        return self._basis @ covariance @ self._basis.T


def damp(residuals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pseudo-Huber: values whose squares grow linearly beyond `_OUTLIER_PX`, and their slopes.

    `least_squares` knows this loss by itself, but not together with MINPACK's method, which took
    a tenth of the time on a machine that other programs use too.
    """
    root = np.sqrt(1 + (residuals / _OUTLIER_PX) ** 2)
    # residuals^2 / (root + 1) is 2 (root - 1) without the cancellation near 0.
    shrink = np.sqrt(2 / (root + 1))
    return residuals * shrink, 1 / (root * shrink)
