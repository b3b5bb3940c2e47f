"""Bundle adjustment: least squares over what all views share and the pose of each.

No view's pose touches another view's points, so the normal equations are an arrow: one block of
what is shared, one small block for each view. The views are eliminated one by one (the Schur
complement), and time grows with their number instead of with its cube.

References
----------
Triggs et al., "Bundle adjustment - a modern synthesis", 2000, doi 10.1007/3-540-44480-7_21;
damping after Nielsen, "Damping parameter in Marquardt's method", 1999.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

POSE = 6
"""Unknowns of a view: rotation vector and translation."""
_DAMPING = 1e-4
_MAX_DAMPING = 1e10
_MAX_STEPS = 100
_MIN_GAIN = 1e-3
"""A step is taken if it lowers the cost by this share of what was predicted."""
_UNDETERMINED = 1e-12
"""Added to the scaled normal equations: what no point tells gets a huge deviation."""


@dataclass(frozen=True)
class NormalEquations:
    """The quadratic that half the cost is near one vector: S shared unknowns, then V poses.

    Attributes
    ----------
    cost
        Sum of the squared residuals there.
    shared, cross, poses
        (V, S, S), (V, S, 6) and (V, 6, 6): of each view's points, blocks of the product of the
        Jacobian with itself.
    shared_slopes, pose_slopes
        (V, S) and (V, 6), likewise half the cost's gradient.
    known, known_slope
        (S, S) and (S,): likewise of what is known without any view.
    """

    cost: float
    shared: np.ndarray
    cross: np.ndarray
    poses: np.ndarray
    shared_slopes: np.ndarray
    pose_slopes: np.ndarray
    known: np.ndarray
    known_slope: np.ndarray

    @cached_property
    def _whole(self) -> np.ndarray:
        """Block of the shared unknowns of all views, (S, S)."""
        return self.shared.sum(axis=0) + self.known

    @cached_property
    def _scale(self) -> tuple[np.ndarray, np.ndarray]:
        """Squared lengths of the Jacobian's columns, (S,) and (V, 6), none of them 0."""
        shared = np.diagonal(self._whole)
        poses = np.diagonal(self.poses, axis1=1, axis2=2)
        return np.where(shared > 0, shared, 1.0), np.where(poses > 0, poses, 1.0)

    def _of_views(self, damping: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What each view tells of the shared unknowns while its pose is free.

        Returns
        -------
        information : ndarray
            (V, S, S)
        slopes : ndarray
            (V, S)
        inverse : ndarray
            (V, 6, 6) of the poses' blocks.
        """
        inverse = np.linalg.inv(self.poses + damping * _diagonals(self._scale[1]))
        carried = self.cross @ inverse
        information = self.shared - carried @ self.cross.transpose(0, 2, 1)
        slopes = self.shared_slopes - np.einsum('vij,vj->vi', carried, self.pose_slopes)
        return information, slopes, inverse

    def step(self, damping: float) -> tuple[np.ndarray, float]:
        """Return the damped step and the fall of the cost that it promises."""
        shared_scale, pose_scale = self._scale
        information, slopes, inverse = self._of_views(damping)
        reduced = information.sum(axis=0) + self.known + damping * np.diag(shared_scale)
        slope = slopes.sum(axis=0) + self.known_slope
        shared = np.linalg.solve(reduced, -slope)
        poses = -np.einsum('vij,vj->vi', inverse, self.pose_slopes + shared @ self.cross)
        whole_slope = self.shared_slopes.sum(axis=0) + self.known_slope
        promised = shared @ (damping * shared_scale * shared - whole_slope)
        promised += np.sum(poses * (damping * pose_scale * poses - self.pose_slopes))
        return np.concatenate([shared, poses.ravel()]), float(promised)

    def each_alone(self) -> np.ndarray:
        """Change (V, S) of the shared unknowns that each view alone asks for."""
        information, slopes, _ = self._of_views(_UNDETERMINED)
        return np.linalg.solve(information, -slopes[..., None])[..., 0]

    def covariance(self, variance: float) -> np.ndarray:
        """Covariance (S, S) of the shared unknowns, from the scatter of points and of views.

        Points of one view are wrong together: its sheet is bent, its light comes from one side.
        So to what their variance says is added by how much the unknowns change where one view
        after another is left out (the jackknife, Efron and Stein 1981,
        doi 10.1214/aos/1176345462, here to first order).

        Parameters
        ----------
        variance
            Of one residual of the points.
        """
        information, slopes, _ = self._of_views(_UNDETERMINED)
        # Scaled, for px and coefficients differ by many orders of magnitude.
        scale = np.sqrt(self._scale[0])
        squared = scale * scale[:, None]
        whole = (information.sum(axis=0) + self.known) / squared + _UNDETERMINED * np.eye(
            len(scale)
        )
        without = whole - information / squared
        changes = np.linalg.solve(without, (slopes / scale)[..., None])[..., 0]
        views = len(slopes)
        scatter = (views - 1) / views * changes.T @ changes
        return (variance * np.linalg.inv(whole) + scatter) / squared


def minimize(
    normal_equations: Callable[[np.ndarray], NormalEquations],
    cost: Callable[[np.ndarray], float],
    start: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Return the vector of the least cost near a start (Levenberg and Marquardt).

    Parameters
    ----------
    normal_equations, cost
        Of a vector; the cost alone is asked for more often.
    start
        (S + 6 V,)
    tolerance
        Relative change of the cost at which to stop.
    """
    vector, damping, growth = start, _DAMPING, 2.0
    here = normal_equations(vector)
    for _ in range(_MAX_STEPS):
        step, promised = here.step(damping)
        fall = here.cost - cost(vector + step)
        if fall > _MIN_GAIN * promised:
            vector = vector + step
            small = tolerance * here.cost
            if fall <= small and promised <= small:
                break
            here = normal_equations(vector)
            damping *= max(1 / 10, 1 - (2 * fall / promised - 1) ** 3)
            growth = 2.0
        else:
            if promised <= tolerance * here.cost or damping > _MAX_DAMPING:
                break
            damping, growth = damping * growth, growth * 2
    return vector


def _diagonals(values: np.ndarray) -> np.ndarray:
    """Diagonal matrices (V, K, K) of values (V, K)."""
    return values[:, :, None] * np.eye(values.shape[1])
