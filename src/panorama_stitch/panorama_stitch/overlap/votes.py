"""Votes: where patches of the overlap lie in both views, and how well that is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, eq=False)
class Votes:
    """Displacements of patches, in the seam frame.

    Attributes
    ----------
    right, left
        (n, 3) rays at which either view shows the patch's centre.
    along, across
        (n, 3) unit tangents: towards where nearness moves the left view's patch, and down.
    deviation
        (n, 2) rad, standard deviations along and across.
    weight
        (n,) area, in squares of 2.5 degrees.
    peak
        (n,) correlation.
    shown
        (m, 2) height, rad, and area of each patch that shows anything at all, voting or not.
    area
        Area of the whole overlap.
    """

    right: np.ndarray
    left: np.ndarray
    along: np.ndarray
    across: np.ndarray
    deviation: np.ndarray
    weight: np.ndarray
    peak: np.ndarray
    shown: np.ndarray
    area: float

    @property
    def height(self) -> np.ndarray:
        """(n,) rad, angles around the line between the lenses; down is positive."""
        return np.arctan2(self.right[:, 1], self.right[:, 2])

    @property
    def textured(self) -> float:
        """Area that shows anything at all."""
        return float(self.shown[:, 1].sum())


_COLUMNS = ('right', 'left', 'along', 'across', 'deviation', 'weight', 'peak')
"""What there is one of for each vote."""


def no_votes() -> Votes:
    """Return an empty set."""
    none = np.zeros((0, 3))
    return Votes(none, none, none, none, none[:, :2], none[:, 0], none[:, 0], none[:, :2], 0.0)


def scaled(votes, area) -> Votes:
    """Set the area of every patch."""
    return replace(
        votes,
        weight=votes.weight * area,
        shown=votes.shown * (1.0, area),
        area=votes.area * area,
    )


def pooled(votes: Sequence[Votes]) -> Votes:
    """Put votes of several frames, in one seam frame, together."""
    joined = {
        name: np.concatenate([getattr(one, name) for one in votes])
        for name in (*_COLUMNS, 'shown')
    }
    return Votes(**joined, area=sum(one.area for one in votes))


def chosen(votes: Votes, which: np.ndarray) -> Votes:
    """Keep the votes that `which` (n,) selects; the areas stay those of all."""
    return replace(votes, **{name: getattr(votes, name)[which] for name in _COLUMNS})


def thinned(votes: Votes, most: int) -> Votes:
    """Keep every so-many-th vote, `most` at most, each with the weight of those that it is for."""
    stride = -(-max(len(votes.peak), 1) // most)
    kept = chosen(votes, np.arange(0, len(votes.peak), stride))
    return replace(kept, weight=kept.weight * stride)
