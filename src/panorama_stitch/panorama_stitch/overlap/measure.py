"""The rotation between two neighbouring cameras, measured on one or more pairs of their images.

Features propose rotations; local votes on the overlap that each would make choose among them, and
fix the one at which the far scene agrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians

import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.confidence import Evidence, confidence
from panorama_stitch.overlap.correspondences import (
    Correspondences,
    join,
    match_features,
    static_mask,
)
from panorama_stitch.overlap.features import find_features
from panorama_stitch.overlap.parallax import Fit, fit_far, stepped
from panorama_stitch.overlap.rotation import Proposal, propose_rotations
from panorama_stitch.overlap.strips import draw_strips
from panorama_stitch.overlap.view import View
from panorama_stitch.overlap.votes import Votes, cast_votes, pooled

_RANK, _COARSE, _FINE = 70.0, 115.0, 230.0
"""Pixels per radian of the strips."""
_PROPOSALS = 8
_CLEAR, _CLEAR_SUPPORTED, _CLEAR_AREA = 0.55, 0.3, 40.0
"""So large a share that agrees ends the search, a smaller one where few features disagree."""
_CLEAR_SUPPORT = 2.5
_REDUNDANT = 4.0
"""Each place of the overlap is in so many patches."""
_LENS_RAD = radians(0.02)
"""No lens is calibrated better."""


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
    """

    rotation: np.ndarray
    frame: np.ndarray
    votes: Votes
    fit: Fit

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
    def merit(self) -> float:
        """What proposals are ranked by: much must agree, and little disagree."""
        return self.far * self.explained**2


@dataclass(frozen=True, eq=False)
class RotationResult:
    """How the right camera is turned against the left one, and how sure that is.

    Attributes
    ----------
    rotation
        Takes rays of the right camera's optical frame to the left one's.
    confidence
        Probability that it is right within half a degree.
    covariance
        (3, 3) rad^2, of a small rotation in the left optical frame.
    near_deg
        How far near things lie beside far ones in the two views; 0 where none is.
    far, near
        (n, 2, 3) pairs of rays, left and right, that far and near things are seen at.
    evidence
        What the confidence is made of.
    """

    rotation: Rotation
    confidence: float
    covariance: np.ndarray
    near_deg: float
    far: np.ndarray
    near: np.ndarray
    evidence: Evidence


def measure_rotation(
    pairs: Sequence[tuple[View, View]],
    *,
    expected: Rotation | None = None,
    within_rad: float = pi,
) -> RotationResult | None:
    """Measure the rotation between two cameras that see a common scene; None if none is seen.

    Parameters
    ----------
    pairs
        One or more pairs of views, left and right, of the same two cameras.
    expected
        What is known before; the search begins there.
    within_rad
        How far the rotation may be from `expected`.
    """
    usable = [_usable(*pair) for pair in pairs]
    near = None if expected is None else expected.as_matrix()
    matches = join([_matches(pair, seen) for pair, seen in zip(pairs, usable, strict=True)])
    proposals = propose_rotations(matches, _PROPOSALS, near=near, within_rad=within_rad)
    if near is not None:
        proposals.append(Proposal(near, 0.0))
    best = _best(pairs, usable, proposals)
    if best is None:
        return None
    chosen, wide = best
    coarse = _try(pairs, usable, wide.rotation, (-4, 6), 1.5, _COARSE) or wide
    fine = _try(pairs, usable, coarse.rotation, (-0.8, 0.8), 0.8, _FINE) or coarse
    rivalled = max((one.support for one in proposals if one is not chosen), default=0.0)
    return _result(min(wide.fit.lead, coarse.fit.lead), coarse, fine, chosen.support, rivalled)


def _best(pairs, usable, proposals) -> tuple[Proposal, Trial] | None:
    """Try proposals until one is clearly right; else find the one with most merit."""
    best = None
    for proposal in proposals:
        trial = _try(pairs, usable, proposal.matrix, (-7, 9), 2.5, _RANK)
        if trial and (best is None or trial.merit > best[1].merit):
            best = proposal, trial
        if best and best[1].far > _CLEAR_AREA:
            rival = max((one.support for one in proposals if one is not best[0]), default=0.0)
            supported = best[0].support > _CLEAR_SUPPORT * rival
            if best[1].explained > (_CLEAR_SUPPORTED if supported else _CLEAR):
                break
    return best


def _usable(left, right):
    """Of either view: 255 where it shows the scene, and not what moves with both cameras."""
    usable = [left.usable, right.usable]
    if _alike(left, right):
        body = static_mask(left.grey, right.grey, (usable[0] & usable[1]) > 0)
        usable = [np.where(body, 0, seen).astype(np.uint8) for seen in usable]
    return tuple(usable)


def _alike(left, right):
    return left.grey.shape == right.grey.shape


def _matches(pair, usable) -> Correspondences:
    left, right = (find_features(view, seen) for view, seen in zip(pair, usable, strict=True))
    return match_features(left, right, static=_alike(*pair))


def _try(pairs, usable, rotation, along_deg, across_deg, density) -> Trial | None:
    votes = []
    for (left, right), seen in zip(pairs, usable, strict=True):
        strips = draw_strips(left, right, rotation, density, seen)
        if strips:
            votes.append(cast_votes(strips, np.radians(along_deg), radians(across_deg)))
            frame = strips.frame
    votes = pooled(votes) if votes else None
    fit = fit_far(votes, scan=density < _FINE) if votes else None
    return None if fit is None else Trial(stepped(rotation, frame, fit.step), frame, votes, fit)


def _result(lead, coarse: Trial, fine: Trial, support, rivalled) -> RotationResult:
    covariance = _REDUNDANT * fine.fit.covariance + np.eye(3) * _LENS_RAD**2
    covariance = fine.frame @ covariance @ fine.frame.T
    peaks = fine.votes.peak[fine.fit.far]
    evidence = Evidence(
        far=fine.far,
        share=fine.share,
        explained=fine.explained,
        coverage=fine.far / max(fine.votes.area, 1e-9),
        coarse_share=coarse.share,
        near_share=float(coarse.votes.weight[coarse.fit.near].sum() / coarse.votes.weight.sum()),
        support=support,
        rivalled=rivalled,
        lead=lead,
        deviation_rad=float(np.sqrt(np.linalg.eigvalsh(covariance)[-1])),
        peak=float(peaks.mean()) if len(peaks) else 0.0,
    )
    return RotationResult(
        rotation=Rotation.from_matrix(fine.rotation),
        confidence=confidence(evidence),
        covariance=covariance,
        near_deg=_near_deg(coarse),
        far=_rays(fine, fine.fit.far),
        near=_rays(coarse, coarse.fit.near),
        evidence=evidence,
    )


def _near_deg(trial) -> float:
    parallax = trial.fit.parallax_rad[trial.fit.near]
    return float(np.degrees(np.percentile(parallax, 90))) if len(parallax) > 2 else 0.0


def _rays(trial, chosen):
    """Pairs of rays (n, 2, 3) in the optical frames of the cameras."""
    left = trial.votes.left[chosen] @ trial.frame.T
    right = trial.votes.right[chosen] @ trial.frame.T
    return np.stack([left, right @ trial.rotation], axis=1)
