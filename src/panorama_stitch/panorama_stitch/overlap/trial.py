"""A rotation put to the vote."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians

import numpy as np

from panorama_stitch.overlap.parallax import Fit, fit_far, stepped
from panorama_stitch.overlap.patches import cast_votes
from panorama_stitch.overlap.strips import draw_strips
from panorama_stitch.overlap.view import OverlapView
from panorama_stitch.overlap.votes import Votes, pooled


@dataclass(frozen=True)
class Reach:
    """How far and how finely patches are looked for.

    Attributes
    ----------
    along_deg, across_deg
        Range along the direction of parallax, and to either side of it.
    density
        Pixels per radian of the strips.
    scan
        Whether other depths than the nearest one are tried.
    spacing_deg
        Between patches.
    """

    along_deg: tuple[float, float]
    across_deg: float
    density: float
    scan: bool = True
    spacing_deg: float = 2.5


@dataclass(frozen=True)
class Stages:
    """From a proposal to an answer."""

    wide: Reach
    close: Reach
    fine: Reach


SHARP = Stages(
    Reach((-7.0, 9.0), 2.5, 70.0),
    Reach((-4.0, 6.0), 1.5, 115.0),
    Reach((-0.8, 0.8), 0.8, 230.0, scan=False),
)
DIM = Stages(
    Reach((-7.0, 9.0), 2.5, 45.0, spacing_deg=5.0),
    Reach((-4.0, 6.0), 1.5, 70.0, spacing_deg=5.0),
    Reach((-1.2, 1.2), 1.2, 115.0, scan=False, spacing_deg=4.0),
)
"""Larger patches, for scenes that are faint, noisy or blurred."""


_CHANCE = 0.1
"""Share of what shows anything that agrees with a wrong rotation."""


@dataclass(frozen=True, eq=False)
class Trial:
    """A rotation and the votes about it.

    Attributes
    ----------
    rotation
        (3, 3) right rays to left ones.
    frame
        (3, 3) axes of the seam in which the votes are, as columns, in the left optical frame.
    votes, fit
        They.
    patch_area
        Of each vote.
    """

    rotation: np.ndarray
    frame: np.ndarray
    votes: Votes
    fit: Fit
    patch_area: float

    @property
    def far(self) -> float:
        """Area that agrees, in patches' spacings."""
        return float(self.votes.weight[self.fit.far].sum())

    @property
    def share(self) -> float:
        """The same, of all that voted."""
        return self.far / max(float(self.votes.weight.sum()), 1e-9)

    @property
    def explained(self) -> float:
        """The same, of all that shows anything."""
        return self.far / max(self.votes.textured, 1e-9)

    @property
    def accounted(self) -> float:
        """What agrees or is near, of all that shows anything, in the half with less of it."""
        height, area = self.votes.shown.T
        counted = self.fit.far | self.fit.near
        upper, voted = height < np.median(height), self.votes.height < np.median(height)
        return min(
            self.votes.weight[counted & those].sum() / max(area[these].sum(), 1e-9)
            for these, those in ((upper, voted), (~upper, ~voted))
        )

    @property
    def significance(self) -> float:
        """By how many deviations more agrees than by chance."""
        chance = _CHANCE * self.votes.textured
        return (self.far - chance) / np.sqrt(chance * self.patch_area + 1)


def try_rotation(
    pairs: Sequence[tuple[OverlapView, OverlapView]], usable, rotation: np.ndarray, reach: Reach
) -> Trial | None:
    """Let the patches of the overlap vote on a rotation (3, 3), and correct it.

    Parameters
    ----------
    pairs
        Views, left and right.
    usable
        For each of them a pair of (height, width) uint8, 255 where a view may be used.
    rotation
        Right rays to left ones.
    reach
        Where patches are looked for.

    Returns
    -------
    Trial or None
        The corrected rotation; None where the views then have nothing in common.
    """
    votes = []
    for (left, right), seen in zip(pairs, usable, strict=True):
        strips = draw_strips(left, right, rotation, reach.density, seen)
        if strips:
            votes.append(
                cast_votes(
                    strips,
                    np.radians(reach.along_deg),
                    radians(reach.across_deg),
                    radians(reach.spacing_deg),
                )
            )
            frame = strips.frame
    votes = pooled(votes) if votes else None
    fit = fit_far(votes, scan=reach.scan) if votes else None
    if fit is None:
        return None
    area = (reach.spacing_deg / SHARP.wide.spacing_deg) ** 2
    return Trial(stepped(rotation, frame, fit.step), frame, votes, fit, area)
