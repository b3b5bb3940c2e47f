"""The published rule: the most similar pair of particles gives the offset, once and for all.

After Al-Harasis and Sababha, 2019, doi 10.1007/s11042-019-7501-z. It is here to be reproduced; on
real scenes the particles that are most alike are seldom the same thing.
"""

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np

from panorama_stitch.overlap.particles import (
    Particle,
    analyse,
    cluster_thresholds,
    facing_halves,
    open_binary,
    remove_small,
)


@dataclass(frozen=True)
class ParticleMatch:
    """The pair of particles that are most alike: indices, and their mean difference."""

    left: int
    right: int
    min_correlation_value: float


def paper_particles(
    half: np.ndarray, *, classes: int = 2, opening: int = 3, erosions: int = 9
) -> tuple[Particle, ...]:
    """Find the particles of a facing half (height, width) uint8: its brightest class."""
    threshold = cluster_thresholds(half, classes)[-1]
    binary = (half > threshold).astype(np.uint8)
    return analyse(remove_small(open_binary(binary, opening), erosions))


def mean_differences(left: Sequence[Particle], right: Sequence[Particle]) -> np.ndarray:
    """Mean absolute difference of the ten properties, (len(left), len(right)) float64."""
    left, right = (
        np.array([astuple(particle) for particle in particles]).reshape(-1, 10)
        for particles in (left, right)
    )
    return np.abs(left[:, None] - right[None]).mean(axis=2)


def match_particles(left: Sequence[Particle], right: Sequence[Particle]) -> ParticleMatch | None:
    """Find the pair with the minimum correlation value; None where a side has no particle."""
    if not (left and right):
        return None
    differences = mean_differences(left, right)
    n, m = np.unravel_index(np.argmin(differences), differences.shape)
    return ParticleMatch(int(n), int(m), float(differences[n, m]))


def offset_x(left_width: int, left: Particle, right: Particle) -> float:
    """Return the column of the left frame at which the right frame goes, px.

    The average of the two centres of mass beside the part of the left frame that faces away.
    """
    remaining = left_width - left_width // 2
    return float(remaining + int((left.center_x + right.center_x) / 2))


def find_match(
    left: np.ndarray, right: np.ndarray, *, classes: int, opening: int, erosions: int
) -> tuple[tuple[Particle, ...], tuple[Particle, ...], ParticleMatch | None]:
    """Run the published procedure: give both sides' particles, and the matched pair if any.

    Parameters
    ----------
    left, right
        Grey frames (height, width) uint8.
    classes, opening, erosions
        As in `paper_particles`.
    """
    sides = [
        paper_particles(half, classes=classes, opening=opening, erosions=erosions)
        for half in facing_halves(left, right)
    ]
    return *sides, match_particles(*sides)
