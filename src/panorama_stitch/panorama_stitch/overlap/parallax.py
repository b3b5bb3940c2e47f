"""The rotation at which what is far agrees, while what is near lies to one side only.

A vote of a near thing tells about the rotation across the direction of parallax, and nothing along
it, but that the thing is not beyond infinity. So votes on the far side of an assumed rotation
cost as much as false ones, and those on the near side little: the far scene wins as long as it has
about a quarter of the votes, whatever stands in front of it.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.votes import Votes, chosen, thinned

_OUTLIER = 20.0
"""Cost of a vote that no depth explains, in squares of its standard deviation."""
_NEAR = 5.0
"""Cost of a vote that nearness explains, and what each radian of it adds: near things are few."""
_NEAR_PER_RAD = 1.3 / np.radians(1.0)
_MODEL_RAD = np.radians(0.12)
"""Lenses and patches agree no better."""
_TWIST = 0.12
"""Parallax leads across by this share: the lenses are not quite where their axes say."""
_SCAN_RAD = tuple(
    np.radians(np.arange(low, high + 0.01, step))
    for low, high, step in ((-2, 2, 0.5), (-8, 4, 0.4), (-3, 3, 0.75))
)
"""Pitch, yaw and roll of the seam that are tried."""
_SCANNED = 150
"""So many votes are enough to tell which of these are worth trying."""
_PARTS = 16
"""So that what is computed of one part stays in the processor's cache."""
_STARTS = 4
_OTHER_RAD = np.radians(1.0)
_HALF_MISSING_RAD = np.radians(5.0)
"""What a half without votes counts as."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A rotation and what the votes say of it.

    Attributes
    ----------
    step
        (3,) rotation vector in the seam frame, to be applied to right rays.
    cost
        Mean cost of a vote.
    covariance
        (3, 3) rad^2, in the seam frame.
    parallax_rad
        (n,) how far each vote lies on the near side.
    far, near
        (n,) bool: votes that agree with the far scene; that nearness explains.
    lead
        By how much the mean cost of any other depth that was tried is higher.
    """

    step: np.ndarray
    cost: float
    covariance: np.ndarray
    parallax_rad: np.ndarray
    far: np.ndarray
    near: np.ndarray
    lead: float = _OUTLIER


class _Problem:
    """Votes, linear in a small rotation."""

    def __init__(self, votes: Votes):
        difference = votes.left - votes.right
        middle = votes.left + votes.right
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        self.along = np.sum(difference * votes.along, axis=1)
        self.across = np.sum(difference * votes.across, axis=1)
        self.turn_along = np.cross(middle, votes.along)
        self.turn_across = np.cross(middle, votes.across)
        self.deviation = np.sqrt(votes.deviation**2 + _MODEL_RAD**2)
        self.weight = votes.weight

    def residuals(self, steps):
        """Standardised residuals along and across (..., n) at rotation vectors (..., 3)."""
        along = self.along - steps @ self.turn_along.T
        across = self.across - steps @ self.turn_across.T
        twisted = np.sqrt(self.deviation[:, 1] ** 2 + (_TWIST * np.maximum(along, 0)) ** 2)
        return along / self.deviation[:, 0], across / twisted, twisted

    def cost(self, steps):
        along, across, _ = self.residuals(steps)
        square = along * along
        near = _NEAR + _NEAR_PER_RAD * along * self.deviation[:, 0]
        square = np.where(along > 0, np.minimum(square, near), square)
        return np.minimum(square + across * across, _OUTLIER) @ self.weight / self.weight.sum()


def fit_far(votes: Votes, *, scan: bool) -> Fit | None:
    """Fit a rotation to votes; None where they are too few.

    Parameters
    ----------
    votes
        They.
    scan
        Whether to try rotations some degrees away first, or only to improve on none.
    """
    if len(votes.peak) < 4:
        return None
    problem = _Problem(votes)
    starts = np.zeros((1, 3))
    if scan:
        grid = np.stack(np.meshgrid(*_SCAN_RAD, indexing='ij'), -1).reshape(-1, 3)
        few = _Problem(thinned(votes, _SCANNED))
        cost = np.concatenate([few.cost(part) for part in np.array_split(grid, _PARTS)])
        starts = []
        while len(starts) < _STARTS and np.isfinite(cost).any():
            starts.append(grid[np.argmin(cost)])
            cost[np.abs(grid[:, 1] - starts[-1][1]) < np.radians(1.0)] = np.inf
    fits = sorted((_descend(problem, start) for start in starts), key=lambda fit: fit.cost)
    best = fits[0]
    others = [f.cost for f in fits if np.linalg.norm(f.step - best.step) > _OTHER_RAD]
    return replace(best, lead=min(others, default=_OUTLIER) - best.cost)


def halves_apart(votes: Votes, fit: Fit, place: np.ndarray) -> float:
    """How far the votes lie elsewhere if only one half of them by `place` (n,) decides, rad.

    What is near fills a part of the overlap: where it alone made the fit, the rest disagrees.
    """
    counted = fit.far | fit.near
    if not counted.any():
        return _HALF_MISSING_RAD
    first = place < np.median(place[counted])
    fits = [fit_far(chosen(votes, half), scan=False) for half in (first, ~first)]
    turn_along = _Problem(votes).turn_along
    return max(
        np.sqrt(np.average((turn_along @ (half.step - fit.step)) ** 2, weights=votes.weight))
        if half
        else _HALF_MISSING_RAD
        for half in fits
    )


def _descend(problem, step) -> Fit:
    for _ in range(12):
        normal, gradient = _normal(problem, step)
        change = np.linalg.solve(normal, gradient)
        length = np.linalg.norm(change)
        step = step + change * min(1.0, np.radians(1.0) / max(length, 1e-12))
        if length < 1e-5:
            break
    along, across, _ = problem.residuals(step)
    fits = across**2 < _OUTLIER / 2
    far = fits & (along * along < np.where(along > 0, _NEAR, _OUTLIER / 2))
    near = fits & ~far & (along > 0)
    normal, _ = _normal(problem, step)
    parallax = problem.along - problem.turn_along @ step
    cost = float(problem.cost(step))
    return Fit(step, cost, np.linalg.inv(normal), parallax, far, near)


def _normal(problem, step):
    """Normal matrix and gradient of the votes that count, with a weak tie to no rotation."""
    along, across, twisted = problem.residuals(step)
    fits = np.maximum(0, 1 - across**2 / _OUTLIER)
    limit = np.where(along > 0, 1.5 * _NEAR, _OUTLIER)
    share_along = fits * np.maximum(0, 1 - along**2 / limit) ** 2
    believable = (along > -3) * np.maximum(0, 1 - across**2 / _OUTLIER) ** 2
    information = problem.weight * share_along / problem.deviation[:, 0] ** 2
    information_across = problem.weight * believable / twisted**2
    normal = (problem.turn_along * information[:, None]).T @ problem.turn_along
    normal += (problem.turn_across * information_across[:, None]).T @ problem.turn_across
    gradient = problem.turn_along.T @ (information * (along * problem.deviation[:, 0]))
    gradient += problem.turn_across.T @ (information_across * (across * twisted))
    return normal + np.eye(3) / np.radians(5.0) ** 2, gradient


def stepped(rotation: np.ndarray, frame: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Apply a fitted step to the rotation (3, 3) whose seam frame it is in."""
    return frame @ Rotation.from_rotvec(step).as_matrix() @ frame.T @ rotation
