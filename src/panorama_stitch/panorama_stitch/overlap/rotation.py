"""Rotations that many correspondences agree on.

A feature with a direction, seen in two conformal pictures, gives a whole rotation; two features
give a sharper one. All are tried against all correspondences.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fisheye_geometry.attitude import closest_rotation
from panorama_stitch.overlap.correspondences import Correspondences

_COARSE_RAD, _FINE_RAD = np.radians(4.0), np.radians(1.2)
_LEAST_TURN_RAD = np.radians(8.0)
"""No rig has two cameras that look the same way."""
_APART_RAD = np.radians(6.0)
_PAIRS = 1500
_ALIKE = 1.5
"""Most cameras of a rig have the same side up: what that is worth."""


@dataclass(frozen=True, eq=False)
class Proposal:
    """A rotation (3, 3) of right rays to left ones, and the weight that supports it."""

    matrix: np.ndarray
    support: float


def propose_rotations(
    matches: Correspondences, count: int, *, near: np.ndarray | None, within_rad: float
) -> list[Proposal]:
    """Find the rotations with most support, best first.

    Parameters
    ----------
    matches
        What is seen in both views.
    count
        How many at most; they differ by some degrees.
    near, within_rad
        A rotation (3, 3) that is known roughly, and how roughly; None: nothing is known.
    """
    if len(matches) < 3:
        return []
    left, right = matches.left[:, :, 0], matches.right[:, :, 0]
    single = matches.left @ matches.right.transpose(0, 2, 1)
    hypotheses = np.concatenate([single, _from_pairs(matches, single)])
    hypotheses = hypotheses[_allowed(hypotheses, near, within_rad)]
    if not len(hypotheses):
        return []
    weight = matches.quality * _spread(left)
    miss = _misses(hypotheses, left, right)
    score = np.maximum(0, 1 - (miss / _FINE_RAD) ** 2) @ weight
    score += 0.3 * (np.maximum(0, 1 - (miss / _COARSE_RAD) ** 2) @ weight)
    score *= np.where(_alike(hypotheses), _ALIKE, 1.0)
    proposals = []
    while len(proposals) < count and score.max() > 0:
        best = hypotheses[np.argmax(score)]
        refined = _refined(best, left, right, weight)
        support = _support(refined, left, right, weight)
        known = [_angles(one.matrix[None], refined)[0] for one in proposals]
        if _allowed(refined[None], near, within_rad)[0] and min(known, default=9) > _APART_RAD:
            proposals.append(Proposal(refined, support))
        for known in (best, refined):
            score[_angles(hypotheses, known) < _APART_RAD] = 0
    return proposals


def added(
    proposals: list[Proposal],
    rotations: Iterable[np.ndarray],
    count: int,
    matches: Correspondences,
    *,
    near: np.ndarray | None,
    within_rad: float,
) -> list[Proposal]:
    """Return the first `count` rotations (3, 3) that are far from all proposals and each other.

    The other parameters are those of `propose_rotations`.
    """
    left, right = matches.left[:, :, 0], matches.right[:, :, 0]
    weight = matches.quality * _spread(left)
    known = [one.matrix for one in proposals]
    found: list[Proposal] = []
    for rotation in rotations:
        if len(found) == count:
            break
        apart = min((_angles(one[None], rotation)[0] for one in known), default=9)
        if apart > _APART_RAD and _allowed(rotation[None], near, within_rad)[0]:
            found.append(Proposal(rotation, _support(rotation, left, right, weight)))
            known.append(rotation)
    return found


def _support(rotation, left, right, weight):
    miss = _misses(rotation[None], left, right)[0]
    return float(np.maximum(0, 1 - (miss / _FINE_RAD) ** 2) @ weight)


def _alike(rotations):
    """Whether two cameras are mounted with the same side up, whichever that is."""
    axis = np.stack([rotations[:, i, j] - rotations[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))])
    return np.abs(axis[2]) < np.sin(np.radians(25)) * np.linalg.norm(axis, axis=0)


def _from_pairs(matches, single):
    """Rotations (n, 3, 3) that take two rays each to theirs, of pairs that may belong together."""
    left, right = matches.left[:, :, 0], matches.right[:, :, 0]
    apart = [np.arccos(np.clip(rays @ rays.T, -1, 1)) for rays in (left, right)]
    first, second = np.nonzero(
        np.triu((np.abs(apart[0] - apart[1]) < np.radians(1.0)) & (apart[0] > np.radians(3.0)))
    )
    agree = _cosine(single[first], single[second]) > np.cos(np.radians(30))
    first, second = first[agree], second[agree]
    best = np.argsort(-(matches.quality[first] * matches.quality[second]), kind='stable')[:_PAIRS]
    first, second = first[best], second[best]
    return _frame(left[first], left[second]) @ _frame(right[first], right[second]).transpose(
        0, 2, 1
    )


def _frame(a, b):
    middle, across = a + b, np.cross(a, b)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    return np.stack([middle, across, np.cross(middle, across)], axis=-1)


def _cosine(a, b):
    """Cosine of the angle between rotations."""
    return np.clip((np.sum(a * b, axis=(-2, -1)) - 1) / 2, -1, 1)


def _angles(rotations, other):
    return np.arccos(_cosine(rotations, other[None]))


def _allowed(rotations, near, within_rad):
    allowed = _angles(rotations, np.eye(3)) > _LEAST_TURN_RAD
    if near is not None:
        allowed &= _angles(rotations, near) <= within_rad
    return allowed


def _misses(rotations, left, right):
    products = (left[:, :, None] * right[:, None]).reshape(-1, 9)
    return np.sqrt(np.maximum(2 - 2 * rotations.reshape(-1, 9) @ products.T, 0))


def _spread(rays):
    """Weight of each ray, lower where many are near it, so that no thing counts twice."""
    near = np.maximum(0, (rays @ rays.T - np.cos(np.radians(4))) / (1 - np.cos(np.radians(4))))
    return 1 / np.maximum(near.sum(axis=1), 1)


def _refined(rotation, left, right, weight):
    for within in (_COARSE_RAD, 2 * _FINE_RAD, _FINE_RAD, _FINE_RAD):
        miss = _misses(rotation[None], left, right)[0]
        share = weight * np.maximum(0, 1 - (miss / within) ** 2)
        if np.count_nonzero(share) < 2:
            return rotation
        rotation = closest_rotation(left, right, share)
    return rotation
