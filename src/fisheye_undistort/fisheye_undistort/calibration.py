"""Calibrate a lens from views of a flat target."""

from dataclasses import dataclass
from itertools import compress

import cv2
import numpy as np

from fisheye_geometry.errors import CalibrationError
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.lens_fit import (
    GROUPS,
    INTRINSICS,
    Estimate,
    View,
    fit,
    lens_of,
    project,
    to_camera,
)
from fisheye_undistort.target import Target

MODELS = (
    ('focal length',),
    ('focal length', 'k1'),
    ('focal length', 'k1', 'principal point'),
    ('focal length', 'k1', 'principal point', 'k2'),
    ('focal length', 'k1', 'principal point', 'k2', 'aspect ratio'),
    ('focal length', 'k1', 'principal point', 'k2', 'aspect ratio', 'k3'),
    ('focal length', 'k1', 'principal point', 'k2', 'aspect ratio', 'k3', 'k4'),
)
"""What is fitted, from what every picture tells to what only many can."""

_EQUATIONS_PER_UNKNOWN = 3
"""Equations left after the poses, for each free intrinsic: nine points hold four of them."""
_FOCAL_SCAN = np.geomspace(0.4, 4.0, 15)
"""Starts tried, in shares of width / pi: from a circle in the middle to a narrow lens."""
_ROUGH = 1e-3
"""Relative change of the cost at which a fit is good enough to start the next from."""
_BIAS_ROUNDS = 6
_BIAS_SETTLED_PX = 0.002
_RIM = np.linspace(0, 2 * np.pi, 32, endpoint=False)
_MISFIT = 4.0
"""A view whose rms is this many times the median does not show what the others show."""
_MISFIT_WIDTHS = 1 / 1000
"""Nor is any view dropped whose rms is below this share of the picture's width."""
_LEAST_COST_PX2 = 1e-8


@dataclass(frozen=True)
class Calibration:
    """A calibrated lens, and what there is to believe in it.

    Attributes
    ----------
    lens
        The result.
    estimate
        Its poses, residuals and covariance, as `lens_fit` gives them.
    views
        Those that were used, in the order of `estimate.poses`.
    dropped
        Name of each view that was not used, and why.
    target
        What was printed.
    """

    lens: FisheyeLens
    estimate: Estimate
    views: tuple[View, ...]
    dropped: dict[str, str]
    target: Target

    @property
    def rms_px(self) -> float:
        """Root mean square distance of all points from where the model puts them."""
        squares = np.concatenate([np.sum(r**2, axis=-1) for r in self.estimate.residuals_px])
        return float(np.sqrt(squares.mean()))

    @property
    def deviations(self) -> dict[str, float]:
        """Standard deviation of each intrinsic; 0 for what was not fitted."""
        return dict(zip(INTRINSICS, np.sqrt(np.diag(self.estimate.covariance)), strict=True))

    @property
    def angles_rad(self) -> np.ndarray:
        """Angles from the axis at which the target's points lie, all views in one array."""
        rays = np.concatenate([
            to_camera(pose, self.target.points_mm[view.ids])
            for pose, view in zip(self.estimate.poses, self.views, strict=True)
        ])
        return np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])


def calibrate(
    views: list[View], target: Target, size: tuple[int, int], *, correct_bias: bool = True
) -> Calibration:
    """Fit a Kannala-Brandt lens to views of a target.

    Parameters
    ----------
    views
        What was seen of the target.
    target
        What was printed.
    size
        Width and height of the pictures, px.
    correct_bias
        Whether to account for a circle's centre of mass not being where its centre is seen.

    Raises
    ------
    CalibrationError
        If there are no views, or none that fit a lens.
    """
    if not views:
        raise CalibrationError('there is no view of the target to calibrate from')
    fitter = _Fitter(views, target, size, correct_bias)
    dropped = {}
    while True:
        ladder = fitter.climb()
        misfits = _misfits(ladder[-1], size)
        if not misfits.any():
            break
        rms = ladder[-1].rms_px[misfits]
        dropped |= {view.name: f'does not fit: rms {miss:.2f} px' for view, miss in
                    zip(compress(fitter.views, misfits), rms, strict=True)}
        fitter = _Fitter([*compress(fitter.views, ~misfits)], target, size, correct_bias)
    estimate = fitter.choose(ladder)
    lens = lens_of(estimate.intrinsics, size)
    return Calibration(lens, estimate, tuple(fitter.views), dropped, target)


class _Fitter:
    """Fits ever richer models to the same views."""

    def __init__(self, views, target, size, correct_bias):
        self.views = views
        self._target = target
        self._correct_bias = correct_bias and target.has_circles
        self._start = _start(views, target.points_mm, size)
        self._equations = 2 * sum(len(view.ids) for view in views)
        affordable = (self._equations - 6 * len(views)) / _EQUATIONS_PER_UNKNOWN
        self._models = [free for free in MODELS if _unknowns(free) <= affordable] or MODELS[:1]

    def _fit(self, estimate: Estimate, free, bias, **how) -> Estimate:
        return fit(self.views, self._target.points_mm, estimate, self._start.intrinsics, free,
                   bias, **how)

    def climb(self) -> list[Estimate]:
        """Fit each model roughly, the next from where the last one ended."""
        ladder = [self._start]
        for free in self._models:
            ladder.append(self._fit(ladder[-1], free, None, tolerance=_ROUGH))
        return ladder[1:]

    def choose(self, ladder: list[Estimate]) -> Estimate:
        """Fit the richest model, then poorer ones for as long as they explain the data better.

        The Bayesian information criterion asks of each intrinsic that it lowers the cost by more
        than chance would (Schwarz 1978, doi 10.1214/aos/1176344136).
        """
        best, bias = None, None
        for start in reversed(ladder):
            estimate, bias = self._without_bias(start, bias)
            variance = max(estimate.cost, _LEAST_COST_PX2) / self._equations
            criterion = self._equations * np.log(variance)
            criterion += _unknowns(estimate.free) * np.log(self._equations)
            if best and criterion > best[0]:
                break
            best = criterion, estimate
        return best[1]

    def _without_bias(self, start: Estimate, bias) -> tuple[Estimate, list | None]:
        """Fit, predict by how much the circles' centres of mass are off, and fit again."""
        estimate = self._fit(start, start.free, bias)
        for _ in range(_BIAS_ROUNDS if self._correct_bias else 0):
            before, bias = bias, center_bias(estimate, self.views, self._target)
            if before and _change(before, bias) < _BIAS_SETTLED_PX:
                break
            estimate = self._fit(estimate, start.free, bias)
        return estimate, bias


def _unknowns(free: tuple[str, ...]) -> int:
    return sum(len(GROUPS[name]) for name in free)


def _change(before, after) -> float:
    return float(np.abs(np.concatenate(before) - np.concatenate(after)).max())


def _start(views: list[View], points_mm: np.ndarray, size: tuple[int, int]) -> Estimate:
    """Try lenses without distortion around focal length = width / pi, the axis in the middle."""
    width, height = size
    candidates = []
    for focal in _FOCAL_SCAN * width / np.pi:
        intrinsics = np.array([focal, focal, (width - 1) / 2, (height - 1) / 2, 0, 0, 0, 0])
        poses = np.array([_pose(view, points_mm, lens_of(intrinsics, size)) for view in views])
        misses = [
            np.linalg.norm(
                project(intrinsics, to_camera(pose, points_mm[view.ids]))[0] - view.points_px,
                axis=-1,
            ).mean()
            for pose, view in zip(poses, views, strict=True)
        ]
        candidates.append((float(np.median(misses)), focal, Estimate(intrinsics, poses)))
    return min(candidates, key=lambda candidate: candidate[0])[2]


def _pose(view: View, points_mm: np.ndarray, lens: FisheyeLens) -> np.ndarray:
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


def _misfits(estimate: Estimate, size: tuple[int, int]) -> np.ndarray:
    """Mark the views (V,) that the lens does not explain as it explains the others."""
    rms = estimate.rms_px
    return rms > max(_MISFIT * np.median(rms), _MISFIT_WIDTHS * size[0])


def center_bias(estimate: Estimate, views: list[View], target: Target) -> list[np.ndarray]:
    """Centre of mass of each projected circle minus the projection of its centre, (N, 2) px."""
    rim = target.radius_mm * np.stack([np.cos(_RIM), np.sin(_RIM), 0 * _RIM], axis=-1)
    biases = []
    for pose, view in zip(estimate.poses, views, strict=True):
        centers = target.points_mm[view.ids]
        circles = to_camera(pose, centers[:, None] + rim)
        outline = project(estimate.intrinsics, circles.reshape(-1, 3))[0].reshape(*circles.shape[:2], 2)
        middle = project(estimate.intrinsics, to_camera(pose, centers))[0]
        biases.append(_centroid(outline - middle[:, None]))
    return biases


def _centroid(polygons: np.ndarray) -> np.ndarray:
    """Centres of mass (N, 2) of polygons (N, K, 2)."""
    following = np.roll(polygons, -1, axis=1)
    cross = polygons[..., 0] * following[..., 1] - polygons[..., 1] * following[..., 0]
    weighted = np.sum((polygons + following) * cross[..., None], axis=1)
    return weighted / (3 * cross.sum(axis=1))[:, None]
