"""Bundle adjustment of a turn: lenses, attitudes, places, angles and landmarks from sightings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.sparse import bsr_matrix, csr_matrix, vstack

from panorama_stitch.turn.expectation import expected, in_metres
from panorama_stitch.turn.landmarks import only
from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import OF_CAMERA, WIDTH, TurnState

_ROUNDS, _EVALUATIONS = 3, 12
_TOLERANCE = 1e-5
_SETTLED = 1e-3
"""Where the cost falls by a smaller share in a round, the fit is done."""
_LIMIT = 2.0
"""Deviations beyond which a residual counts linearly, and for the last time, ..."""
_OUTLIER = 6.0
"""... and those from which it does not count at all."""
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
    residuals_px
        (N, 2), found minus predicted.
    noise_px
        Deviation of one coordinate of a sighting.
    """

    state: TurnState
    seen: Sightings
    covariance: np.ndarray
    residuals_px: np.ndarray
    noise_px: float


def adjust(
    state: TurnState,
    seen: Sightings,
    sizes: Sequence[tuple[int, int]],
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
        Width and height of each camera's pictures, px.
    yaws_known
        Whether landmarks are seen by several cameras; else the yaw of each stays what it is.
    noise_px
        Expected deviation of a coordinate.
    """
    state, seen = _without_rare(state, seen)
    free = _free(state, yaws_known)
    cost = np.inf
    for _ in range(_ROUNDS):
        problem = _Problem(state, seen, sizes, free, noise_px)
        state, now = problem.solve()
        residuals = seen.pixels - state.predict(seen)
        noise_px = max(1.4826 * float(np.median(np.abs(residuals))), _LEAST_NOISE_PX)
        good = np.linalg.norm(residuals, axis=1) < _OUTLIER * noise_px
        if now > (1 - _SETTLED) * cost and good.all():
            break
        cost = now if good.all() else np.inf
        state, seen = _without_rare(state, seen.only(good))
        free = _free(state, yaws_known)
    problem = _Problem(state, seen, sizes, free, noise_px)
    return TurnFit(state, seen, problem.covariance(), seen.pixels - state.predict(seen), noise_px)


def _free(state: TurnState, yaws_known: bool) -> np.ndarray:
    """Mark the unknowns that are fitted: the world's and the rig's frame must not drift."""
    free = np.ones(state.rig_count + 3 * len(state.directions), bool)
    for camera in range(len(state.lenses)):
        if camera == 0 or not yaws_known:
            free[WIDTH * camera + OF_CAMERA.index('turn_y')] = False
            free[WIDTH * camera + OF_CAMERA.index('place_y')] = False
    free[WIDTH * len(state.lenses)] = False
    return free


def _without_rare(state: TurnState, seen: Sightings) -> tuple[TurnState, Sightings]:
    """Leave out the landmarks that are seen too seldom."""
    counts = np.bincount(seen.landmark, minlength=len(state.directions))
    return only(state, seen, counts >= _LEAST_SIGHTINGS)


class _Problem:
    """Residuals and derivatives as functions of a step from a state, in units of deviations."""

    def __init__(self, state, seen, sizes, free, noise_px):
        self._start, self._seen, self._free, self._noise = state, seen, free, noise_px
        self._sizes = sizes

    def solve(self) -> tuple[TurnState, float]:
        solution = least_squares(
            self._residuals,
            np.zeros(np.count_nonzero(self._free)),
            self._jacobian,
            loss='soft_l1',
            f_scale=_LIMIT,
            x_scale='jac',
            tr_solver='lsmr',
            ftol=_TOLERANCE,
            max_nfev=_EVALUATIONS,
        )
        return in_metres(self._moved(solution.x)), float(solution.cost)

    def covariance(self) -> np.ndarray:
        """Return the covariance of cameras and angles, of which landmarks took their part."""
        jacobian = self._jacobian(np.zeros(np.count_nonzero(self._free)))
        count = np.count_nonzero(self._free[: self._start.rig_count])
        information = (jacobian.T @ jacobian).tocsr()
        shared = information[:count, count:]
        # No sighting is of two landmarks: their part of the information is made of 3 x 3 blocks.
        blocks = information[count:, count:].tobsr((3, 3))
        inverse = bsr_matrix((np.linalg.inv(blocks.data), blocks.indices, blocks.indptr))
        reduced = (information[:count, :count] - shared @ inverse @ shared.T).toarray()
        covariance = np.zeros((self._start.rig_count,) * 2)
        free = np.flatnonzero(self._free[: self._start.rig_count])
        covariance[np.ix_(free, free)] = np.linalg.inv(reduced)
        return covariance

    def _moved(self, step) -> TurnState:
        whole = np.zeros(len(self._free))
        whole[self._free] = step
        return self._start.moved(whole)

    def _residuals(self, step):
        state = self._moved(step)
        miss = (state.predict(self._seen) - self._seen.pixels) / self._noise
        return np.concatenate([miss.ravel(), expected(state, self._sizes)[0]])

    def _jacobian(self, step):
        state, seen = self._moved(step), self._seen
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
        return vstack([sparse, expected(state, self._sizes)[1]]).tocsc()[:, self._free].tocsr()
