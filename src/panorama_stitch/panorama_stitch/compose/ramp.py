"""Ramps: how far one view has given way to the next."""

import numpy as np

Fading = tuple[int, int] | np.ndarray | None
"""Where one view gives way to the other: columns [begin, end) of a strip, None for all of them;
or, where the seam is not upright, how far it has, (height, width) float32 from 0 to 1."""


def ramp_over(shape: tuple[int, int], fade: Fading) -> np.ndarray:
    """Return how far the left view has given way to the right one, (height, width) from 0 to 1."""
    if isinstance(fade, np.ndarray):
        return fade
    begin, end = fade or (0, shape[1])
    columns = np.arange(shape[1], dtype=np.float32) + 0.5 - begin
    return np.broadcast_to((columns / max(end - begin, 1e-3)).clip(0, 1), shape)


def columns_of(ramp: np.ndarray) -> tuple[int, int]:
    """Return the columns [begin, end) of a ramp outside of which one view is alone."""
    right, left = (np.flatnonzero(where.any(axis=0)) for where in (ramp > 0, ramp < 1))
    return int(right[0]) if len(right) else ramp.shape[1], int(left[-1]) + 1 if len(left) else 0
