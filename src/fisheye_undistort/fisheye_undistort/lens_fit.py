"""Least squares over a lens and the poses of a target, with analytic derivatives."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import least_squares

from fisheye_geometry.lens import FisheyeLens

INTRINSICS = (
    'focal_x_px', 'focal_y_px', 'center_x_px', 'center_y_px', 'k1', 'k2', 'k3', 'k4',
)
GROUPS = {
    'focal length': ((1, 1, 0, 0, 0, 0, 0, 0),),
    'principal point': ((0, 0, 1, 0, 0, 0, 0, 0), (0, 0, 0, 1, 0, 0, 0, 0)),
    'aspect ratio': ((0, 1, 0, 0, 0, 0, 0, 0),),
    'k1': ((0, 0, 0, 0, 1, 0, 0, 0),),
    'k2': ((0, 0, 0, 0, 0, 1, 0, 0),),
    'k3': ((0, 0, 0, 0, 0, 0, 1, 0),),
    'k4': ((0, 0, 0, 0, 0, 0, 0, 1),),
}
"""What can be fitted together or left as it is: directions in the space of the intrinsics."""

_POSE = 6
_OUTLIER_PX = 1.0
"""Beyond this a residual counts linearly: one wrong point must not pull the lens."""
_MAX_EVALUATIONS = 100
_EVEN_POWERS = 2.0 * np.arange(1, 5)
_UNDETERMINED = 1e-12
"""Added to the scaled normal equations: what no point tells gets a huge deviation."""


@dataclass(frozen=True)
class View:
    """One picture of the target.

    Attributes
    ----------
    name
        Of the picture.
    points_px
        (N, 2) float64, found in it.
    ids
        (N,) int, the points of the target that they are.
    """

    name: str
    points_px: np.ndarray
    ids: np.ndarray


@dataclass(frozen=True)
class Estimate:
    """A lens and the poses of the target before it, as good as known so far.

    Attributes
    ----------
    intrinsics
        (8,) in the order of `INTRINSICS`.
    poses
        (V, 6) rotation vector and translation, target to camera, rad and mm.
    residuals_px
        One (N, 2) array for each view: found minus predicted.
    covariance
        (8, 8) of the intrinsics; 0 for what was not fitted.
    cost
        Twice the robust cost, px^2.
    free
        Names of the `GROUPS` that were fitted.
    """

    intrinsics: np.ndarray
    poses: np.ndarray
    residuals_px: tuple[np.ndarray, ...] = ()
    covariance: np.ndarray | None = None
    cost: float = np.inf
    free: tuple[str, ...] = ()

    @property
    def rms_px(self) -> np.ndarray:
        """Root mean square distance of each view's points, (V,) px."""
        return np.array([rms(residuals) for residuals in self.residuals_px])


def rms(residuals_px: np.ndarray) -> float:
    """Root of the mean squared length of residuals (N, 2)."""
    return float(np.sqrt(np.mean(np.sum(residuals_px**2, axis=-1))))


def lens_of(intrinsics: np.ndarray, size: tuple[int, int]) -> FisheyeLens:
    """Build the lens for pictures of (width, height)."""
    focal_x, focal_y, center_x, center_y, *distortion = map(float, intrinsics)
    return FisheyeLens(*size, focal_x, focal_y, center_x, center_y, tuple(distortion))


def to_camera(pose: np.ndarray, points_mm: np.ndarray) -> np.ndarray:
    """Points (..., 3) of the target in the camera's frame, for one pose (6,)."""
    return points_mm @ cv2.Rodrigues(pose[:3])[0].T + pose[3:]


def fit(views: list[View], points_mm: np.ndarray, start: Estimate, nominal: np.ndarray,
        free: tuple[str, ...], bias_px: list[np.ndarray] | None = None,
        tolerance: float = 1e-8) -> Estimate:
    """Fit the free groups of intrinsics and every pose.

    Parameters
    ----------
    views
        What was seen.
    points_mm
        (M, 3) of the target.
    start
        Intrinsics and poses to begin with.
    nominal
        (8,) intrinsics; those that are not free have these values.
    free
        Names of `GROUPS`.
    bias_px
        One (N, 2) array for each view, added to what is predicted for each point.
    tolerance
        Relative change of the cost at which to stop.
    """
    problem = _Problem(views, points_mm, nominal, free, bias_px)
    solution = least_squares(
        problem.residuals, problem.pack(start), problem.jacobian, method='lm', x_scale='jac',
        ftol=tolerance, max_nfev=_MAX_EVALUATIONS,
    )
    intrinsics, poses = problem.unpack(solution.x)
    misses = problem.misses_px(solution.x)
    return Estimate(
        intrinsics, poses,
        residuals_px=tuple(-part for part in np.split(misses, problem.splits)),
        covariance=problem.covariance(solution), cost=2 * solution.cost, free=free,
    )


class _Problem:
    """Residuals and their derivatives as functions of one vector: free intrinsics, then poses."""

    def __init__(self, views, points_mm, nominal, free, bias_px):
        counts = [len(view.ids) for view in views]
        self.splits = np.cumsum(counts)[:-1]
        self._view = np.repeat(np.arange(len(views)), counts)
        self._points = np.concatenate([points_mm[view.ids] for view in views])
        self._found = np.concatenate([view.points_px for view in views])
        if bias_px is not None:
            self._found = self._found - np.concatenate(bias_px)
        self._basis = np.array([row for name in free for row in GROUPS[name]], float).T
        self._nominal = nominal

    def pack(self, estimate):
        """Give the vector whose intrinsics are nearest to those of an estimate."""
        change = estimate.intrinsics - self._nominal
        intrinsics = np.linalg.lstsq(self._basis, change, rcond=None)[0]
        return np.concatenate([intrinsics, estimate.poses.ravel()])

    def unpack(self, vector):
        """Intrinsics (8,) and poses (V, 6)."""
        count = self._basis.shape[1]
        return self._nominal + self._basis @ vector[:count], vector[count:].reshape(-1, _POSE)

    def misses_px(self, vector):
        """Predicted minus found, (N, 2)."""
        intrinsics, poses = self.unpack(vector)
        points, _ = self._to_camera(poses)
        return project(intrinsics, points)[0] - self._found

    def residuals(self, vector):
        """Misses (2 N,) px, damped so that the sum of their squares is a robust cost."""
        return _damp(self.misses_px(vector))[0].ravel()

    def jacobian(self, vector):
        """Derivatives of `residuals`, (2 N, len(vector))."""
        intrinsics, poses = self.unpack(vector)
        points, by_turn = self._to_camera(poses)
        pixels, by_intrinsics, by_point = project(intrinsics, points)
        count = self._basis.shape[1]
        jacobian = np.zeros((len(points), 2, len(vector)))
        jacobian[:, :, :count] = by_intrinsics @ self._basis
        by_pose = np.concatenate([by_point @ by_turn, by_point], axis=-1)
        columns = count + _POSE * self._view[:, None] + np.arange(_POSE)
        np.put_along_axis(jacobian, columns[:, None, :].repeat(2, axis=1), by_pose, axis=-1)
        jacobian *= _damp(pixels - self._found)[1][..., None]
        return jacobian.reshape(-1, len(vector))

    def _to_camera(self, poses):
        """Points (N, 3) in the camera's frame and their derivatives (N, 3, 3) by the turns."""
        pairs = [cv2.Rodrigues(pose[:3]) for pose in poses]
        rotation = np.array([matrix for matrix, _ in pairs])[self._view]
        slopes = np.array([slope.reshape(3, 3, 3) for _, slope in pairs])[self._view]
        points = np.einsum('nij,nj->ni', rotation, self._points) + poses[self._view, 3:]
        return points, np.einsum('nkij,nj->nik', slopes, self._points)

    def covariance(self, solution):
        """Covariance (8, 8) of the intrinsics, from the Jacobian and the scatter of residuals."""
        scale = np.linalg.norm(solution.jac, axis=0)
        scale[scale == 0] = 1.0
        information = (solution.jac / scale).T @ (solution.jac / scale)
        inverse = np.linalg.inv(information + _UNDETERMINED * np.eye(len(scale)))
        excess = max(len(solution.fun) - len(solution.x), 1)
        free = slice(self._basis.shape[1])
        covariance = 2 * solution.cost / excess * (inverse / scale / scale[:, None])[free, free]
        return self._basis @ covariance @ self._basis.T


def _damp(misses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pseudo-Huber: values whose squares grow linearly beyond `_OUTLIER_PX`, and their slopes.

    `least_squares` knows this loss by itself, but not together with MINPACK's method, which took
    a tenth of the time on a machine that other programs use too.
    """
    root = np.sqrt(1 + (misses / _OUTLIER_PX) ** 2)
    # misses^2 / (root + 1) is 2 (root - 1) without the cancellation near 0.
    shrink = np.sqrt(2 / (root + 1))
    return misses * shrink, 1 / (root * shrink)


def project(intrinsics: np.ndarray, points: np.ndarray):
    """Project points as `FisheyeLens` does, with derivatives and without an end of the field.

    Parameters
    ----------
    intrinsics
        (8,) in the order of `INTRINSICS`.
    points
        (N, 3) in the camera's frame.

    Returns
    -------
    pixels : ndarray
        (N, 2) px.
    by_intrinsics : ndarray
        (N, 2, 8) derivatives.
    by_point : ndarray
        (N, 2, 3) derivatives.
    """
    x, y, z = points.T
    focal, center, coefficients = intrinsics[:2], intrinsics[2:4], intrinsics[4:]
    side = np.maximum(np.hypot(x, y), 1e-12)
    angle = np.arctan2(side, z)
    powers = angle[:, None] ** _EVEN_POWERS
    growth = 1 + powers @ coefficients
    slope = 1 + powers @ (coefficients * (_EVEN_POWERS + 1))
    toward = np.stack([x, y], axis=-1) / side[:, None]
    plane = toward * (angle * growth)[:, None]
    by_intrinsics = np.zeros((len(points), 2, len(intrinsics)))
    by_intrinsics[:, [0, 1], [0, 1]] = plane
    by_intrinsics[:, [0, 1], [2, 3]] = 1.0
    by_intrinsics[:, :, 4:] = (focal * toward)[..., None] * (angle[:, None] * powers)[:, None]
    # Away from the axis the radius changes by the slope; around it the angle stays.
    squared = side**2 + z**2
    outward = (slope * z / squared)[:, None, None] * toward[:, :, None] * toward[:, None]
    across = np.eye(2) - toward[:, :, None] * toward[:, None]
    outward += (angle * growth / side)[:, None, None] * across
    inward = -(slope * side / squared)[:, None] * toward
    by_point = focal[:, None] * np.concatenate([outward, inward[..., None]], axis=-1)
    return plane * focal + center, by_intrinsics, by_point
