"""Bundle adjustment of a turn: lenses, attitudes, places, angles and landmarks from sightings."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.sparse import csr_matrix, diags, vstack

from fisheye_core.errors import CalibrationError
from panorama_stitch.turn.elimination import Elimination
from panorama_stitch.turn.expectation import expected, in_metres
from panorama_stitch.turn.landmarks import only
from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import OF_CAMERA, WIDTH, TurnState

_ROUNDS, _STEPS = 5, 30
_TOLERANCE = 3e-5
"""A step that lowers the cost by a smaller share is the last one of its round."""
_SETTLED = 1e-3
"""Where the cost falls by a smaller share in a round, the fit is done."""
_LIMIT = 2.0
"""Deviations beyond which a residual counts linearly, and for the last time, ..."""
_OUTLIER = 6.0
"""... and those from which it does not count at all."""
_FIRST_DAMPING, _DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-5, 1e-8, 1e6
"""Of a first estimate, which had better stay near where it begins than follow a valley in which
nothing but noise tells cameras apart; and of others, where a step that only the damping keeps
short would be taken for the last one."""
_LEAST_NOISE_PX = 0.02
_LEAST_SIGHTINGS = 2


@dataclass(frozen=True)
class TurnFit:
    """What explains the sightings best.

    Attributes
    ----------
    state
        It.
    seen
        The sightings that it explains; their landmarks are those of the state.
    covariance
        (state.rig_count, state.rig_count) of cameras and angles, as `TurnState.moved` takes them.
    noise_px
        Deviation of one coordinate of a sighting.
    """

    state: TurnState
    seen: Sightings
    covariance: np.ndarray
    noise_px: float


def adjust(
    state: TurnState,
    seen: Sightings,
    sizes: Mapping[str, tuple[int, int]],
    *,
    yaws_known: bool,
    noise_px: float = 0.5,
) -> TurnFit:
    """Fit all unknowns to the sightings, and leave out those that do not belong.

    Parameters
    ----------
    state
        To begin with.
    seen
        What was seen where.
    sizes
        Width and height of the pictures of each camera, by its name, px.
    yaws_known
        Whether landmarks are seen by several cameras; else the yaw of each stays what it is.
    noise_px
        Expected deviation of a coordinate.

    Raises
    ------
    CalibrationError
        If a camera is left without sightings.
    """
    state, seen = _without_rare(state, seen)
    free = _free(state, seen, sizes, yaws_known)
    cost = np.inf
    for _ in range(_ROUNDS):
        state, now = _TurnProblem(seen, sizes, free, noise_px, not yaws_known).solve(state)
        residuals = seen.pixels - state.predict(seen)
        noise_px = max(1.4826 * float(np.median(np.abs(residuals))), _LEAST_NOISE_PX)
        good = np.linalg.norm(residuals, axis=1) < _OUTLIER * noise_px
        if now > (1 - _SETTLED) * cost and good.all():
            break
        cost = now if good.all() else np.inf
        state, seen = _without_rare(state, seen.only(good))
        free = _free(state, seen, sizes, yaws_known)
    covariance = _TurnProblem(seen, sizes, free, noise_px, not yaws_known).covariance(state)
    return TurnFit(state, seen, covariance, noise_px)


def _free(
    state: TurnState, seen: Sightings, cameras: Iterable[str], yaws_known: bool
) -> np.ndarray:
    """Mark the unknowns that are fitted: the world's and the rig's frame must not drift.

    A frame during a jolt may be left without sightings: nothing tells its angle.
    """
    free = np.ones(state.rig_count + 3 * len(state.directions), bool)
    for camera, name in enumerate(cameras):
        if camera not in seen.camera:
            raise CalibrationError(
                f'nothing that {name} saw fits a turn on the spot; expected a robot that turns '
                'without jolts before things that stand still'
            )
        if camera == 0 or not yaws_known:
            free[WIDTH * camera + OF_CAMERA.index('turn_y')] = False
            free[WIDTH * camera + OF_CAMERA.index('place_y')] = False
    angles = WIDTH * len(state.lenses)
    free[angles : state.rig_count] = np.isin(np.arange(len(state.angles)), seen.frame)
    free[angles + seen.frame.min()] = False
    return free


def _without_rare(state: TurnState, seen: Sightings) -> tuple[TurnState, Sightings]:
    """Leave out the landmarks that are seen too seldom."""
    counts = np.bincount(seen.landmark, minlength=len(state.directions))
    return only(state, seen, counts >= _LEAST_SIGHTINGS)


class _TurnProblem:
    """Residuals and derivatives of a state, in units of deviations."""

    def __init__(
        self,
        seen: Sightings,
        sizes: Mapping[str, tuple[int, int]],
        free: np.ndarray,
        noise_px: float,
        first: bool,
    ):
        self._seen, self._free, self._noise = seen, free, noise_px
        self._damping = _FIRST_DAMPING if first else _DAMPING
        self._expected = partial(expected, sizes=list(sizes.values()), first=first)

    def solve(self, state: TurnState) -> tuple[TurnState, float]:
        """Return the state of least cost near another, and its cost.

        Levenberg and Marquardt's method. Each step is exact, for landmarks are eliminated: they
        are many, but none has anything to do with another.
        """
        damping, residuals = self._damping, self._residuals(state)
        cost = _cost(residuals)
        for _ in range(_STEPS):
            information, gradient = self._normal_equations(state, residuals)
            while damping < _MOST_DAMPING:
                after = in_metres(state.moved(self._step(state, information, gradient, damping)))
                residuals_after = self._residuals(after)
                cost_after = _cost(residuals_after)
                if cost_after < cost:
                    break
                damping *= 10
            else:
                break
            gain = 1 - cost_after / cost
            state, residuals, cost = after, residuals_after, cost_after
            damping = max(damping / 10, _LEAST_DAMPING)
            if gain < _TOLERANCE:
                break
        return state, cost

    def covariance(self, state: TurnState) -> np.ndarray:
        """Return the covariance of cameras and angles, of which landmarks took their part."""
        information, _ = self._normal_equations(state, self._residuals(state))
        free = np.flatnonzero(self._free[: state.rig_count])
        covariance = np.zeros((state.rig_count,) * 2)
        covariance[np.ix_(free, free)] = np.linalg.inv(Elimination(information, len(free)).reduced)
        return covariance

    def _step(self, state, information, gradient, damping):
        count = np.count_nonzero(self._free[: state.rig_count])
        damped = information + diags(damping * information.diagonal())
        step = np.zeros(len(self._free))
        step[self._free] = -Elimination(damped.tocsr(), count).solve(gradient)
        return step

    def _normal_equations(self, state, residuals):
        """Return information and gradient, each residual with the weight that its size has."""
        weight = diags(1 / np.sqrt(1 + (residuals / _LIMIT) ** 2))
        jacobian = self._jacobian(state)
        return (jacobian.T @ weight @ jacobian).tocsr(), jacobian.T @ (weight @ residuals)

    def _residuals(self, state):
        miss = (state.predict(self._seen) - self._seen.pixels) / self._noise
        return np.concatenate([miss.ravel(), self._expected(state)[0]])

    def _jacobian(self, state):
        seen = self._seen
        blocks = np.concatenate(state.derivatives(seen), axis=-1) / self._noise
        columns = np.concatenate(
            [
                WIDTH * seen.camera[:, None] + np.arange(WIDTH),
                WIDTH * len(state.lenses) + seen.frame[:, None],
                state.rig_count + 3 * seen.landmark[:, None] + np.arange(3),
            ],
            axis=1,
        )
        rows, each = 2 * len(seen), blocks.shape[-1]
        sparse = csr_matrix(
            (
                blocks.ravel(),
                columns.repeat(2, axis=0).ravel(),
                np.arange(0, rows * each + 1, each),
            ),
            shape=(rows, len(self._free)),
        )
        return vstack([sparse, self._expected(state)[1]]).tocsc()[:, self._free].tocsr()


def _cost(residuals: np.ndarray) -> float:
    """Pseudo-Huber cost."""
    return float(2 * _LIMIT**2 * np.sum(np.sqrt(1 + (residuals / _LIMIT) ** 2) - 1))
