"""The probability that a measured rotation is right within half a degree."""

from dataclasses import dataclass
from math import erf

import numpy as np

RIGHT_RAD = np.radians(0.5)
"""What `right` means."""
_LEAST_APART_RAD = np.radians(0.05)
"""Halves that are nearer to one another agree."""
_LEAST_ACCOUNTED, _ENOUGH_ACCOUNTED = 0.02, 0.3
"""A half of which more is accounted for tells no more by it."""
_WEIGHTS = (-12.583, -0.069, 4.816, 2.64, 0.573, 0.631, 0.53, -1.725, -0.534, 0.956)
"""Of `Evidence.features`, as benchmarks/fit_confidence.py prints them."""


@dataclass(frozen=True)
class Evidence:
    """What a measurement's votes amount to.

    Attributes
    ----------
    far
        Area that agrees with what is far, in patches.
    share
        The same as a share of all that voted near the answer.
    explained
        The same of all that shows anything.
    coverage
        The same of the whole overlap.
    support
        Weight of the matched features that proposed it.
    rivalled
        Merit of the best other rotation that was tried, as a share of that of this one.
    near_share
        Share of those that nearness explains.
    lead
        By how much any other depth fits worse.
    halves_rad
        How far the scene lies elsewhere if only one half of the overlap decides: the upper or the
        lower one, or that towards either camera.
    accounted
        Share of what shows anything that agrees or is near, in that half where it is less.
    significance
        By how many deviations more agrees than by chance, of all within some degrees; of one pair.
    deviation_rad
        Largest standard deviation of the rotation.
    peak
        Mean correlation of the patches that agree.
    """

    far: float
    share: float
    explained: float
    coverage: float
    support: float
    rivalled: float
    near_share: float
    lead: float
    halves_rad: float
    accounted: float
    significance: float
    deviation_rad: float
    peak: float

    @property
    def features(self) -> np.ndarray:
        """(10,) what the logistic regression works on."""
        return np.array(
            [
                1.0,
                np.log(self.far + 1.0),
                self.share,
                self.explained,
                np.log(self.support + 0.1),
                np.log(max(self.significance, 0.0) + 0.3),
                np.log(1.0001 - self.peak),
                np.log(self.halves_rad + _LEAST_APART_RAD),
                np.log(self.rivalled + 0.05),
                np.log(np.clip(self.accounted, _LEAST_ACCOUNTED, _ENOUGH_ACCOUNTED)),
            ]
        )


def confidence(evidence: Evidence) -> float:
    """Return the probability, 0 to 1, that the rotation is right.

    That it is the right one of all there may be (logistic regression on rendered rigs), and that
    its deviation then leaves it within half a degree.
    """
    is_it = 1 / (1 + np.exp(-np.dot(_WEIGHTS, evidence.features)))
    return float(is_it * erf(RIGHT_RAD / (2**0.5 * evidence.deviation_rad)))
