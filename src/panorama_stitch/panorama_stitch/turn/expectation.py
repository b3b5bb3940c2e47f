"""What is expected of a rig before anything is seen: it holds what no sighting does."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import coo_matrix

from panorama_stitch.turn.turn_state import OF_CAMERA, WIDTH, TurnState

NEARNESS = 0.3
"""Of landmarks, 1/m, and how much it differs between them. Only its product with the places shows:
this alone makes them metres."""
_MEAN_DEVIATION = 0.5
"""Of the mean nearness of all landmarks. Where everything is equally near, a camera off the axis
sees what one with another focal length sees on it: that things are about as near as they differ in
it is all that tells the two apart."""
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
_FIRST_HOLD = 20.0
"""How much more both are held in a first estimate."""
_BEHIND_DEVIATION = 0.1
"""Of a nearness below 0, which no thing has."""
_QUARTILES_APART = 1.35
"""In deviations of a normal distribution."""
_LEAST_SPREAD = 1e-3


def expected(
    state: TurnState, sizes: Sequence[tuple[int, int]], *, first: bool
) -> tuple[np.ndarray, coo_matrix]:
    """Return how many deviations the unknowns are from what is expected, and the derivatives.

    Parameters
    ----------
    state
        The unknowns.
    sizes
        Width and height of each camera's pictures, px.
    first
        Whether it is for a first estimate, far from the truth: pixels are square then, the axis is
        near the middle, and landmarks are held ahead of infinity, lest what is near be taken for
        far and a place for its opposite.

    Returns
    -------
    misses : ndarray
        (M,).
    slopes : coo_matrix
        (M, all unknowns) by what `TurnState.moved` changes.
    """
    hold = _FIRST_HOLD if first else 1.0
    misses: list[float] = []
    slopes: list[float] = []
    rows: list[int] = []
    columns: list[int] = []

    def add(miss, **by):
        for name, slope in by.items():
            rows.append(len(misses))
            columns.append(begin + OF_CAMERA.index(name))
            slopes.append(slope)
        misses.append(miss)

    for camera, (lens, place, size) in enumerate(
        zip(state.lenses, state.places, sizes, strict=True)
    ):
        begin = WIDTH * camera
        for name, deviation in _DEVIATIONS.items():
            index = OF_CAMERA.index(name)
            value = lens[index] if index < len(lens) else place[index - WIDTH]
            add(value / deviation, **{name: 1 / deviation})
        focal_x, focal_y = lens[:2]
        deviation = _ASPECT_DEVIATION / hold
        add(
            (focal_x / focal_y - 1) / deviation,
            focal_x_px=1 / focal_y / deviation,
            focal_y_px=-focal_x / focal_y**2 / deviation,
        )
        deviation = _CENTER_DEVIATION_WIDTHS * size[0] / hold
        for name, value, side in zip(('center_x_px', 'center_y_px'), lens[2:4], size, strict=True):
            add((value - (side - 1) / 2) / deviation, **{name: 1 / deviation})
    landmarks = np.arange(len(state.nearness))
    # The mean of all landmarks is held as if each of them were by so little.
    each = np.full(len(landmarks), 1 / (_MEAN_DEVIATION * np.sqrt(max(len(landmarks), 1))))
    behind = np.where(state.nearness < 0, float(first) / _BEHIND_DEVIATION, 0.0)
    nearness = state.rig_count + 3 * landmarks + 2
    values = np.concatenate([slopes, each, behind])
    places = (
        np.concatenate([rows, len(misses) + np.arange(2 * len(landmarks))]),
        np.concatenate([columns, nearness, nearness]),
    )
    shape = (len(misses) + 2 * len(landmarks), state.rig_count + 3 * len(landmarks))
    return (
        np.concatenate([misses, (state.nearness - NEARNESS) * each, state.nearness * behind]),
        coo_matrix((values, places), shape=shape),
    )


def in_metres(state: TurnState) -> TurnState:
    """Scale places and landmarks so that these lie ahead, as unlike in nearness as expected."""
    low, middle, high = np.percentile(state.nearness, (25, 50, 75))
    spread = max(float(high - low) / _QUARTILES_APART, _LEAST_SPREAD)
    return state.scaled(NEARNESS / (spread if middle > 0 else -spread))
