"""Which landmarks a turn is fitted with, and where to look for them."""

from dataclasses import replace

import numpy as np

from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import TurnState

_ACROSS_DEG, _UP_DEG = 12, 15
_IN_CELL = 3
"""Landmarks in each cell of directions: all around counts, not where there is most."""
_LEAST_SIGHTINGS = 5


def own_camera(seen: Sightings, count: int) -> np.ndarray:
    """Return which camera saw each landmark, (count,) int, while none saw another's."""
    camera = np.zeros(count, int)
    camera[seen.landmark] = seen.camera
    return camera


def spread(state: TurnState, seen: Sightings, *, yaws_known: bool) -> tuple[TurnState, Sightings]:
    """Keep the landmarks that were seen longest, few in any direction.

    Those that link two frames only, across the end of the turn, stay too. Until the yaws of the
    cameras are known, each camera has directions of its own.
    """
    counts = np.bincount(seen.landmark, minlength=len(state.directions))
    camera = np.zeros(len(counts), int) if yaws_known else own_camera(seen, len(counts))
    first, newest = (_extreme(seen, len(counts), of) for of in (np.minimum, np.maximum))
    is_link = newest - first > counts
    x, y, z = state.directions.T
    around = (np.degrees(np.arctan2(x, z)) // _ACROSS_DEG).astype(int)
    up = (np.degrees(np.arcsin(y.clip(-1, 1))) // _UP_DEG).astype(int)
    _, cell = np.unique(np.stack([camera, around, up, is_link]), axis=1, return_inverse=True)
    order = np.lexsort((-counts, cell.ravel()))
    _, start, size = np.unique(cell.ravel()[order], return_index=True, return_counts=True)
    rank = np.arange(len(order)) - np.repeat(start, size)
    kept = np.zeros(len(counts), bool)
    kept[order[rank < _IN_CELL]] = True
    return only(state, seen, kept & (is_link | (counts >= _LEAST_SIGHTINGS)))


def only(state: TurnState, seen: Sightings, kept: np.ndarray) -> tuple[TurnState, Sightings]:
    """Keep some landmarks, a mask (L,), and number them anew."""
    number = np.cumsum(kept) - 1
    seen = seen.only(kept[seen.landmark])
    return (
        replace(state, directions=state.directions[kept], nearness=state.nearness[kept]),
        replace(seen, landmark=number[seen.landmark]),
    )


def clearest(state: TurnState, seen: Sightings) -> Sightings:
    """Return the sighting of each landmark that is nearest to the axis of its camera."""
    x, y, z = state.rays(seen).T
    order = np.lexsort((np.arctan2(np.hypot(x, y), z), seen.landmark))
    _, first = np.unique(seen.landmark[order], return_index=True)
    return seen.only(order[first])


def everywhere(state: TurnState, share: float) -> Sightings:
    """Return a share of all landmarks in each frame of each camera, without pixels."""
    counts = len(state.lenses), len(state.angles), len(state.directions)
    camera, frame, landmark = (index.ravel() for index in np.indices(counts))
    # By chance: any pattern would part the frames into groups that share no landmarks.
    due = np.random.default_rng(0).random(len(frame)) < share
    pixels = np.zeros((np.count_nonzero(due), 2))
    return Sightings(camera[due], frame[due], landmark[due], pixels)


def _extreme(seen, count, of):
    result = np.full(count, seen.frame.max() if of is np.minimum else 0)
    of.at(result, seen.landmark, seen.frame)
    return result
