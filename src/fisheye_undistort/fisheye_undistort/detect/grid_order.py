"""Put circles into the order of a printed grid, however strongly the lens bends it."""

from heapq import heappop, heappush
from itertools import count

import numpy as np
from scipy.signal import correlate2d

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.circle_grid import Circles
from fisheye_undistort.target.target import Target

_TOLERANCE = 0.3
"""How far a neighbour may lie from where it is expected, as a share of the smallest step."""
_MIN_SHARE = 0.93
"""Fewer circles than this share of the grid are not taken for the grid."""
_SEEDS = 3
"""How often a circle is reached before it is no start any more: a start may be a stray."""


class GridNotFoundError(CalibrationError):
    """No grid of circles as the target has it.

    Attributes
    ----------
    circles : int
        How many the largest grid holds that there is.
    """

    def __init__(self, reason: str, circles: int):
        super().__init__(reason)
        self.circles = circles


def order_grid(circles: Circles, target: Target) -> tuple[np.ndarray, np.ndarray]:
    """Find the grid among circles and tell which point of the target each circle is.

    A circle's image tells how the print is stretched at its place (a Jacobian but for a rotation),
    so each circle knows where its neighbours must be, and they in turn know theirs: no line needs
    to be straight.

    Returns
    -------
    points_px : ndarray
        (M, 2) centres of mass of the grid's circles.
    ids : ndarray
        (M,) int, rows of `target.points_mm`; a few circles may be missing.

    Raises
    ------
    GridNotFoundError
        If there is no such grid.
    """
    neighbourhood = _Neighbourhood(circles, target)
    best, largest = None, {-1: (0, 0)}
    visits = np.zeros(len(circles), int)
    for seed in range(len(circles)):
        if visits[seed] >= _SEEDS:
            continue
        grown = [neighbourhood.grow(seed, start) for start in neighbourhood.hypotheses(seed)]
        for cells, mismatch in grown:
            largest = max(largest, cells, key=len)
            matched = _match(cells, target)
            rank = (len(matched), -mismatch) if matched else (0, 0.0)
            if matched and (best is None or rank > best[0]):
                best = rank, matched
        visits[list({circle for cells, _ in grown for circle in cells})] += 1
    if best is None:
        raise GridNotFoundError(_what_is_there(circles, largest, target), len(largest))
    ids = np.array(sorted(best[1]))
    return circles.centers[[best[1][i] for i in ids]], ids


class _Neighbourhood:
    """Local stretch of the print at each circle, and the steps to its neighbours."""

    def __init__(self, circles: Circles, target: Target):
        self._centers = circles.centers
        values, vectors = np.linalg.eigh(circles.shapes)
        scale = 2 * np.sqrt(values) / target.radius_mm
        self._stretch = (vectors * scale[:, None, :]) @ vectors.transpose(0, 2, 1)
        self._shrink = np.linalg.inv(self._stretch)
        spacing = np.array([target.dx_mm, target.dy_mm])
        self._steps = np.concatenate([target.steps, np.negative(target.steps)]).tolist()
        self._steps_mm = self._steps * spacing
        lengths = np.linalg.norm(self._steps_mm, axis=1)
        self._limit_mm = _TOLERANCE * lengths.min()
        self._reach_mm = lengths.max() + self._limit_mm

    def hypotheses(self, seed: int):
        """Jacobians (2, 2), px/mm: the nearest circle may be reached by any of the steps."""
        near = self._near(seed)
        if not len(near):
            return
        offsets = self._offsets_mm(seed, near, self._stretch[seed], self._stretch[near])
        offset = offsets[np.argmin(np.hypot(*offsets.T))]
        for step_mm in self._steps_mm:
            if abs(np.hypot(*offset) - np.hypot(*step_mm)) < self._limit_mm:
                yield self._stretch[seed] @ _rotations(_angle(offset) - _angle(step_mm))

    def grow(self, seed: int, jacobian: np.ndarray) -> tuple[dict[int, tuple[int, int]], float]:
        """Walk from neighbour to neighbour, the surest step first.

        Returns
        -------
        cells : dict
            Column and row, counted from the seed, of each circle that was reached.
        mismatch_mm : float
            Mean distance of the circles from where the steps led.
        """
        cells: dict[int, tuple[int, int]] = {}
        residuals: list[float] = []
        steps: list[tuple[float, int, list]] = []
        order = count()
        circle, cell, residual = seed, (0, 0), 0.0
        while True:
            if circle not in cells and cell not in cells.values():
                cells[circle] = cell
                residuals.append(residual)
                for residual, *step in self._steps_from(circle, cell, jacobian):
                    heappush(steps, (residual, next(order), step))
            if not steps:
                return cells, float(np.mean(residuals))
            residual, _, (circle, cell, jacobian) = heappop(steps)

    def _steps_from(self, at: int, cell: tuple, jacobian: np.ndarray):
        """Steps to the neighbours of a circle: mismatch, circle, cell, and the Jacobian there."""
        near = self._near(at)
        there = self._carry(jacobian, near)
        offsets = self._offsets_mm(at, near, jacobian, there)
        residuals = np.linalg.norm(offsets - self._steps_mm[:, None], axis=-1)
        which, where = np.nonzero(residuals < self._limit_mm)
        # Where the step really led tells how far the turn has drifted on the way here.
        drift = _angle(offsets[where]) - _angle(self._steps_mm[which])
        corrected = there[where] @ _rotations(drift)
        for step, other, turned in zip(which, where, corrected, strict=True):
            following = (cell[0] + self._steps[step][0], cell[1] + self._steps[step][1])
            yield float(residuals[step, other]), int(near[other]), following, turned

    def _near(self, at: int) -> np.ndarray:
        """Circles within reach of one step."""
        offsets = (self._centers - self._centers[at]) @ self._shrink[at]
        distance = np.hypot(*offsets.T)
        # The print shrinks towards the picture's edge: what is far here may be near from there.
        return np.flatnonzero((distance > 0) & (distance < 2 * self._reach_mm))

    def _carry(self, jacobian: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Jacobians (K, 2, 2) of other circles: their own stretch, turned as little as can be."""
        change = self._shrink[others] @ jacobian
        turn = np.arctan2(change[:, 1, 0] - change[:, 0, 1], change[:, 0, 0] + change[:, 1, 1])
        return self._stretch[others] @ _rotations(turn)

    def _offsets_mm(self, at: int, others: np.ndarray, jacobian, there) -> np.ndarray:
        """Offsets (K, 2) on the sheet; the mean Jacobian of both ends is right to second order."""
        offsets_px = (self._centers[others] - self._centers[at])[..., None]
        return np.linalg.solve((jacobian + there) / 2, offsets_px)[..., 0]


def _angle(vectors: np.ndarray) -> np.ndarray:
    return np.arctan2(vectors[..., 1], vectors[..., 0])


def _rotations(angle) -> np.ndarray:
    """Rotations (..., 2, 2) by angles (...), rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], axis=-1), np.stack([s, c], axis=-1)], axis=-2)


def _match(cells: dict[int, tuple], target: Target) -> dict[int, int] | None:
    """Shift cells onto the target; its ids to circles, or None if it is another grid."""
    found = np.array(list(cells.values()))
    found -= found.min(axis=0)
    shifts = correlate2d(_occupied(found), _occupied(target.cells))
    most = shifts.max()
    # A dark thing beside the sheet may pass for a neighbour; where circles are missing too, the
    # whole order is in doubt.
    wanted = len(target.cells)
    sure = most == wanted or 2 * most - len(cells) >= _MIN_SHARE * wanted
    if not sure or np.count_nonzero(shifts == most) > 1:
        return None
    shift = np.array(np.unravel_index(shifts.argmax(), shifts.shape))[::-1]
    moved = found - shift + target.cells.max(axis=0)
    ids = {tuple(cell): i for i, cell in enumerate(target.cells.tolist())}
    at = zip(map(tuple, moved.tolist()), cells, strict=True)
    return {ids[cell]: circle for cell, circle in at if cell in ids}


def _occupied(cells: np.ndarray) -> np.ndarray:
    """Mark cells (N, 2), column and row, in an array of rows and columns."""
    grid = np.zeros(cells.max(axis=0)[::-1] + 1, int)
    grid[cells[:, 1], cells[:, 0]] = 1
    return grid


def _what_is_there(circles: Circles, cells: dict[int, tuple], target: Target) -> str:
    wanted = f'expected {target.rows} rows and {target.columns} columns'
    lines = [np.unique(axis, return_counts=True) for axis in np.array(list(cells.values())).T]
    # A line of its own is a stray's, not the sheet's.
    lines = [line[count > 1] for line, count in lines]
    if not all(len(line) for line in lines):
        return f'no grid among {len(circles)} dark round particles; {wanted}'
    columns, rows = (np.ptp(line) + 1 for line in lines)
    if target.kind == 'acircles':
        columns //= 2
    if (rows, columns) == (target.rows, target.columns):
        whole = len(target.cells)
        return f'only {len(cells)} of the {whole} circles of the grid; the sheet is cut off'
    return f'a grid of circles, {rows} x {columns} (rows x columns), found; {wanted}'
