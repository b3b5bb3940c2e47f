"""Fit the confidence of an overlap: logistic regression on random rigs with known truth.

The places and seeds are apart from those on which `overlap.py` reports. Prints what belongs into
`panorama_stitch/overlap/confidence.py`.
"""

import argparse
import sys

import cv2
import numpy as np
from rigs import random_rig

from panorama_stitch.overlap.confidence import RIGHT_RAD, Evidence
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.view import OverlapView

FIRST_SEED = 50000
RIDGE = 1.0
"""Weight of a tie to 0, in cases: what the rigs do not tell stays out."""


def main() -> int:
    """Print the weights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--rigs', type=int, default=600, help='with a common scene')
    parser.add_argument('--apart', type=int, default=60, help='without')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    evidence, right = [], []
    for common, count in ((True, options.rigs), (False, options.apart)):
        for seed in range(FIRST_SEED, FIRST_SEED + count):
            rig = random_rig(seed, common=common)
            views = OverlapView(rig.left, rig.lenses[0]), OverlapView(rig.right, rig.lenses[1])
            result = measure_rotation([views])
            if result.evidence is not None:
                evidence.append(result.evidence)
                error = (rig.rotation.inv() * result.rotation).magnitude()
                right.append(common and error <= RIGHT_RAD)
    print(tuple(np.round(fit(evidence, np.array(right, float)), 3).tolist()))
    return 0


def fit(evidence: list[Evidence], right: np.ndarray) -> np.ndarray:
    """Return the weights of a logistic regression (Newton's method), with a ridge.

    Parameters
    ----------
    evidence
        Of n measurements.
    right
        (n,) 1 where one is right, 0 elsewhere.
    """
    features = np.array([one.features for one in evidence])
    middle, scale = features.mean(axis=0), features.std(axis=0)
    middle[0], scale[0] = 0.0, 1.0
    x = (features - middle) / scale
    ridge = np.diag([0.0, *[RIDGE] * (x.shape[1] - 1)])
    weights = np.zeros(x.shape[1])
    for _ in range(30):
        probability = 1 / (1 + np.exp(-x @ weights))
        information = (x * (probability * (1 - probability))[:, None]).T @ x + ridge
        weights += np.linalg.solve(information, x.T @ (right - probability) - ridge @ weights)
    plain = weights / scale
    plain[0] -= plain[1:] @ middle[1:]
    return plain


if __name__ == '__main__':
    sys.exit(main())
