"""Two calibrations, each from half of the landmarks: what they disagree in, nobody knows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fisheye_geometry.attitude import rotation_vector
from panorama_stitch.turn.bundle import TurnFit, adjust
from panorama_stitch.turn.landmarks import only
from panorama_stitch.turn.turn_state import OF_CAMERA, TurnState

_SECTOR_RAD = np.radians(20)
"""Halves are every other sector around: what moves or is near spoils one of them only."""


@dataclass(frozen=True)
class TurnHalves:
    """Two fits.

    Attributes
    ----------
    states
        Of either half.
    scale
        By which deviations from the covariance have to grow so that the halves agree; at least 1.
    """

    states: tuple[TurnState, TurnState]
    scale: float


def halves_of(fit: TurnFit, sizes: Mapping[str, tuple[int, int]]) -> TurnHalves:
    """Fit either half of the landmarks, beginning with what fits all of them, as `adjust` does."""
    x, _, z = fit.state.directions.T
    is_odd = (np.arctan2(x, z) // _SECTOR_RAD).astype(int) % 2 == 1
    fits = []
    for half in (is_odd, ~is_odd):
        state, seen = only(fit.state, fit.seen, half)
        fits.append(adjust(state, seen, sizes, yaws_known=True, noise_px=fit.noise_px))
    one, other = (half.state for half in fits)
    apart = _apart(one, other)
    covariance = fits[0].covariance + fits[1].covariance
    variance = np.diag(covariance)[: apart.size].reshape(apart.shape)
    # The places are known but for a factor, which differs.
    known = (variance > 0) & np.array([not name.startswith('place') for name in OF_CAMERA])
    return TurnHalves((one, other), max(1.0, _rms(apart[known] / np.sqrt(variance[known]))))


def _apart(one: TurnState, other: TurnState) -> np.ndarray:
    """Differences (C, WIDTH) of two states in what they say of the cameras."""
    turns = [
        rotation_vector(first @ second.T)
        for first, second in zip(one.attitudes, other.attitudes, strict=True)
    ]
    return np.concatenate([one.lenses - other.lenses, turns, one.places - other.places], axis=1)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
