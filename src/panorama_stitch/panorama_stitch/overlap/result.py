"""What measuring a rotation gives, and what limits it, in a word and a sentence."""

from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.confidence import Evidence

LIMITS = {
    '': 'the far scene agrees all over the overlap',
    'apart': 'no common scene was found',
    'few': 'the overlap shows too little to hold on to',
    'repeating': 'the scene repeats itself, and another rotation fits nearly as well',
    'depths': 'two depths compete for the far scene',
    'near': 'most of the overlap is near',
}
"""What limits a measurement, and what that means."""
_LITTLE, _SMALL_PART = 30.0, 0.15
_MOSTLY = 0.5
_SLIGHT_LEAD = 0.3


def _no_rays() -> np.ndarray:
    return np.zeros((0, 2, 3))


@dataclass(frozen=True, eq=False)
class RotationResult:
    """How the right camera is turned against the left one, and how sure that is.

    Attributes
    ----------
    rotation
        Takes rays of the right camera's optical frame to the left one's; the best one there is,
        whether it is believed or not. None where nothing was seen at all.
    found
        Whether it is believed.
    confidence
        Probability that it is right within half a degree.
    covariance
        (3, 3) rad^2, of a small rotation in the left optical frame.
    near_deg
        How far near things lie beside far ones in the two views; 0 where none is.
    far, near
        (n, 2, 3) pairs of rays, left and right, at which far and near things are seen.
    evidence
        What the confidence is made of; None where nothing was seen.
    """

    rotation: Rotation | None
    found: bool = False
    confidence: float = 0.0
    covariance: np.ndarray | None = None
    near_deg: float = 0.0
    far: np.ndarray = field(default_factory=_no_rays)
    near: np.ndarray = field(default_factory=_no_rays)
    evidence: Evidence | None = None

    @property
    def votes(self) -> int:
        """Number of patches that far and near things were seen in."""
        return len(self.far) + len(self.near)

    @property
    def limit(self) -> str:
        """What limits the measurement, one of `LIMITS`."""
        evidence = self.evidence
        if evidence is None:
            return 'apart'
        if evidence.near_share > _MOSTLY:
            return 'near' if self.found else 'apart'
        if evidence.lead < _SLIGHT_LEAD:
            return 'depths'
        if evidence.rivalled > evidence.support:
            return 'repeating'
        if evidence.far < _LITTLE or evidence.coverage < _SMALL_PART:
            return 'few'
        return ''

    @property
    def message(self) -> str:
        """One sentence for a person."""
        words = f'confidence {self.confidence:.2f}: {LIMITS[self.limit]}'
        if self.near_deg:
            words += f'; near things lie up to {self.near_deg:.1f} degrees beside far ones'
        return words

    def nearest_m(self, baseline_m: float) -> float:
        """Distance of the nearest things of the overlap for lenses that far apart."""
        return baseline_m / np.radians(self.near_deg) if self.near_deg else np.inf

    def aligned_at(self, distance_m: float, baseline_m: float) -> Rotation | None:
        """Return the rotation that makes both views agree at a distance instead of far away."""
        if self.rotation is None:
            return None
        there = self.rotation.apply([0.0, 0.0, 1.0])
        axis = np.cross([0.0, 0.0, 1.0], there)
        # A near thing lies further to the right in the left view: the right view follows it.
        axis *= baseline_m / distance_m / np.linalg.norm(axis)
        return Rotation.from_rotvec(axis) * self.rotation
