"""The rotation between two neighbouring cameras, measured on one or more pairs of their images.

Features, or coarse pictures where these are few, propose rotations; local votes on the overlap
that each would make choose among them, and fix the one at which the far scene agrees.
"""

from collections.abc import Sequence
from math import pi, radians

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.choice import choose, is_clear
from panorama_stitch.overlap.coarse import coarse_rotations
from panorama_stitch.overlap.confidence import Evidence, confidence
from panorama_stitch.overlap.correspondences import (
    Correspondences,
    join,
    match_features,
    static_mask,
)
from panorama_stitch.overlap.features import find_features
from panorama_stitch.overlap.parallax import halves_apart
from panorama_stitch.overlap.result import RotationResult
from panorama_stitch.overlap.rotation import Proposal, added, propose_rotations
from panorama_stitch.overlap.trial import SHARP, Trial, try_rotation
from panorama_stitch.overlap.view import OverlapView

MIN_CONFIDENCE = 0.7
"""Below it two views count as having no common scene."""
_PROPOSALS, _COARSE_PROPOSALS = 8, 5
_AGREEING, _PROPOSING = 2, 3
"""Pairs of images in which features are looked for: enough if they agree, and at most."""
_SURELY_NEAR = 0.15
"""Share of the votes below which what seems near is a few wrong ones."""
_REDUNDANT = 4.0
"""Each place of the overlap is in so many patches."""
_LENS_RAD = radians(0.02)
"""No lens is calibrated better."""
_BODY_WIDTH_PX = 640
"""A body that moves with the cameras is looked for in images about as wide, or a little wider."""


def measure_rotation(
    pairs: Sequence[tuple[OverlapView, OverlapView]],
    *,
    expected: Rotation | None = None,
    within_rad: float = pi,
    min_confidence: float = MIN_CONFIDENCE,
) -> RotationResult:
    """Measure the rotation between two cameras that see a common scene.

    Parameters
    ----------
    pairs
        One or more pairs of views, left and right, of the same two cameras.
    expected
        What is known before, right rays to left ones; the search begins there.
    within_rad
        How far the rotation may be from `expected`.
    min_confidence
        With less the rotation is not believed.
    """
    usable = [_usable(*pair) for pair in pairs]
    near = None if expected is None else expected.as_matrix()
    known = {'near': near, 'within_rad': within_rad}
    seen: dict[int, Correspondences] = {}
    proposals: list[Proposal] = []
    for i in range(0, len(pairs), -(-len(pairs) // _PROPOSING)):
        seen[i] = _matches(pairs[i], usable[i])
        matches = join(list(seen.values()))
        proposals = propose_rotations(matches, _PROPOSALS, **known)
        if len(seen) >= _AGREEING and is_clear(proposals):
            break
    if near is not None:
        proposals.append(Proposal(near, 0.0))

    def more():
        coarse = coarse_rotations(*pairs[0], usable[0])
        return added(proposals, coarse, _COARSE_PROPOSALS, matches, **known)

    best = choose(pairs, usable, list(seen), proposals, more)
    if best is None:
        return RotationResult(None)
    chosen, stages, wide, close = best.proposal, best.stages, best.wide, best.close
    reaches = dict.fromkeys((stages.fine, SHARP.fine))
    fits = [try_rotation(pairs, usable, close.rotation, reach) for reach in reaches]
    fine = min([close, *filter(None, fits)], key=_variance)
    rotation = Rotation.from_matrix(fine.rotation)
    if expected is not None and (expected.inv() * rotation).magnitude() > within_rad:
        return RotationResult(None)
    covariance = _REDUNDANT * fine.fit.covariance + np.eye(3) * _LENS_RAD**2
    height, across = fine.votes.height, fine.votes.right[:, 0]
    evidence = Evidence(
        far=fine.far / len(pairs),
        share=fine.share,
        explained=fine.explained,
        coverage=fine.far / max(fine.votes.area, 1e-9),
        support=chosen.support / len(seen),
        rivalled=best.rivalled,
        near_share=float(close.votes.weight[close.fit.near].sum() / close.votes.weight.sum()),
        lead=min(wide.fit.lead, close.fit.lead),
        halves_rad=float(
            max(halves_apart(fine.votes, fine.fit, place) for place in (height, across))
        ),
        accounted=float(close.accounted),
        significance=float(wide.significance) / len(seen) ** 0.5,
        deviation_rad=float(np.sqrt(np.linalg.eigvalsh(covariance)[-1])),
        peak=float(np.mean(fine.votes.peak[fine.fit.far])) if fine.fit.far.any() else 0.0,
    )
    sure = confidence(evidence)
    return RotationResult(
        rotation=rotation,
        found=sure >= min_confidence,
        confidence=sure,
        covariance=fine.frame @ covariance @ fine.frame.T,
        near_deg=_near_deg(close),
        votes=int(fine.fit.far.sum() + close.fit.near.sum()),
        evidence=evidence,
    )


def _usable(left, right):
    """Of either view: 255 where it shows the scene, and not what moves with both cameras."""
    usable = [left.usable, right.usable]
    if _alike(left, right):
        height, width = left.grey.shape
        step = max(1, width // _BODY_WIDTH_PX)
        size = (width // step, max(1, height // step))
        small = [
            cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
            for grey in (left.grey, right.grey)
        ]
        seen = cv2.resize(usable[0] & usable[1], size, interpolation=cv2.INTER_NEAREST)
        body = static_mask(*small, seen > 0).astype(np.uint8)
        body = cv2.resize(body, (width, height), interpolation=cv2.INTER_NEAREST)
        usable = [np.where(body, 0, seen).astype(np.uint8) for seen in usable]
    return tuple(usable)


def _alike(left, right):
    return left.grey.shape == right.grey.shape


def _matches(pair, usable) -> Correspondences:
    left, right = (find_features(view, seen) for view, seen in zip(pair, usable, strict=True))
    return match_features(left, right, static=_alike(*pair))


def _variance(trial: Trial) -> float:
    return float(np.linalg.eigvalsh(trial.fit.covariance)[-1])


def _near_deg(trial) -> float:
    weight = trial.votes.weight
    if weight[trial.fit.near].sum() < _SURELY_NEAR * weight.sum():
        return 0.0
    return float(np.degrees(np.percentile(trial.fit.parallax_rad[trial.fit.near], 90)))
