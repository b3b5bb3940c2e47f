"""What is expected of a rig before anything is seen: it holds what no sighting does."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix

from panorama_stitch.turn.turn_state import OF_CAMERA, WIDTH, TurnState

NEARNESS = 0.3
"""Of landmarks, 1/m. Only their product with the places shows: this alone makes them metres."""
_NEARNESS_DEVIATION = 0.5
_DEVIATIONS = {
    'k1': 0.1,
    'k2': 0.05,
    'k3': 0.02,
    'k4': 0.005,
    'place_x': 0.3,
    'place_y': 0.3,
    'place_z': 0.3,
}
"""Of the coefficients of real lenses and the places of cameras from 0."""
_CENTER_DEVIATION_WIDTHS = 0.03
_ASPECT_DEVIATION = 0.002


def expected(state: TurnState, sizes: Sequence[tuple[int, int]]) -> tuple[np.ndarray, coo_matrix]:
    """Return how many deviations the unknowns are from what is expected, and the derivatives.

    Parameters
    ----------
    state
        The unknowns.
    sizes
        Width and height of each camera's pictures, px.

    Returns
    -------
    misses : ndarray
        (M,).
    slopes : coo_matrix
        (M, all unknowns) by what `TurnState.moved` changes.
    """
    misses: list[float] = []
    slopes: list[float] = []
    rows: list[int] = []
    columns: list[int] = []

    def add(miss, **by):
        for name, slope in by.items():
            rows.append(len(misses))
            columns.append(first + OF_CAMERA.index(name))
            slopes.append(slope)
        misses.append(miss)

    for camera, (lens, place, size) in enumerate(
        zip(state.lenses, state.places, sizes, strict=True)
    ):
        first = WIDTH * camera
        for name, deviation in _DEVIATIONS.items():
            index = OF_CAMERA.index(name)
            value = lens[index] if index < len(lens) else place[index - WIDTH]
            add(value / deviation, **{name: 1 / deviation})
        focal_x, focal_y = lens[:2]
        add(
            (focal_x / focal_y - 1) / _ASPECT_DEVIATION,
            focal_x_px=1 / focal_y / _ASPECT_DEVIATION,
            focal_y_px=-focal_x / focal_y**2 / _ASPECT_DEVIATION,
        )
        deviation = _CENTER_DEVIATION_WIDTHS * size[0]
        for name, value, side in zip(('center_x_px', 'center_y_px'), lens[2:4], size, strict=True):
            add((value - (side - 1) / 2) / deviation, **{name: 1 / deviation})
    landmarks = np.arange(len(state.nearness))
    unknowns = state.rig_count + 3 * len(landmarks)
    return (
        np.concatenate([misses, (state.nearness - NEARNESS) / _NEARNESS_DEVIATION]),
        coo_matrix(
            (
                np.concatenate([slopes, np.full(len(landmarks), 1 / _NEARNESS_DEVIATION)]),
                (
                    np.concatenate([rows, len(misses) + landmarks]),
                    np.concatenate([columns, state.rig_count + 3 * landmarks + 2]),
                ),
            ),
            shape=(len(misses) + len(landmarks), unknowns),
        ),
    )


def in_metres(state: TurnState) -> TurnState:
    """Scale places and landmarks so that these are as near as is expected."""
    return state.scaled(NEARNESS / max(float(np.mean(state.nearness)), 1e-3))
