"""What measuring a rotation gives, and what limits it, in a word and a sentence."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.confidence import Evidence

LIMITS = {
    '': 'the far scene agrees all over the overlap',
    'apart': 'hardly anything far agrees',
    'few': 'the overlap shows too little to hold on to',
    'repeating': 'the scene repeats itself, and another rotation fits nearly as well',
    'depths': 'two depths compete for the far scene',
    'near': 'most of the overlap is near',
}
"""What limits a measurement, and what that means."""
_LITTLE, _SMALL_PART = 30.0, 0.15
_MOSTLY = 0.5
_SLIGHT_LEAD, _NEARLY = 0.3, 0.7


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
    votes
        Number of patches that far and near things were seen in.
    evidence
        What the confidence is made of; None where nothing was seen.
    """

    rotation: Rotation | None
    found: bool = False
    confidence: float = 0.0
    covariance: np.ndarray | None = None
    near_deg: float = 0.0
    votes: int = 0
    evidence: Evidence | None = None

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
        if evidence.rivalled > _NEARLY:
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
