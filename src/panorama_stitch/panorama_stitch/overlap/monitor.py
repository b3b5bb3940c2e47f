"""How well a rotation in use still holds, and how it sharpens, from one pair of frames a second.

A robot moves: near things move through the overlap, what is far stays in place. So the votes of
many moments tell more than those of one, and a mount that has moved shows in all of them.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.parallax import fit_far, stepped
from panorama_stitch.overlap.patches import cast_votes
from panorama_stitch.overlap.strips import draw_strips, seam_frame
from panorama_stitch.overlap.view import OverlapView
from panorama_stitch.overlap.votes import Votes, pooled, thinned

_DENSITY = 115.0
_ALONG_RAD, _ACROSS_RAD = np.radians((-3.5, 4.5)), np.radians(3.0)
_MOMENTS, _VOTES = 30, 250
"""Memory: moments, and votes of each."""
_DRIFT_RAD, _DRIFT_S = np.radians(0.5), 10.0
_LEAST_FAR = 8.0
"""Area, in patches, without which a moment tells nothing."""
_LEAST_MOMENTS = 5
_AGREES_RAD = np.radians(0.4)
_STEADY = 0.8
"""Share of the moments that must tell the same drift."""


@dataclass(frozen=True)
class SeamState:
    """How well a seam holds.

    Attributes
    ----------
    quality
        0 to 1: of what both views show at this moment, the share of the area that falls in place
        within 0.4 degrees.
    drift_deg
        How far the mount has moved since the rotation was measured, over the last 10 s; NaN
        while too little was seen.
    drifted
        Whether that is more than 0.5 degrees, and has been for 10 s.
    """

    quality: float
    drift_deg: float
    drifted: bool


class SeamMonitor:
    """Votes of the last moments about one rotation.

    Parameters
    ----------
    rotation
        In use: right rays to left ones.
    """

    def __init__(self, rotation: Rotation):
        self._rotation = rotation.as_matrix()
        self._frame = seam_frame(self._rotation)
        self._votes: deque[Votes] = deque(maxlen=_MOMENTS)
        self._steps: deque[tuple[float, np.ndarray]] = deque(maxlen=_MOMENTS)

    def look(self, left: OverlapView, right: OverlapView, stamp_s: float) -> SeamState:
        """Account for one more pair of frames.

        Parameters
        ----------
        left, right
            What both cameras show at one moment.
        stamp_s
            When, on any clock that does not go back.
        """
        strips = draw_strips(left, right, self._rotation, _DENSITY)
        votes = cast_votes(strips, _ALONG_RAD, _ACROSS_RAD) if strips else None
        votes = thinned(votes, _VOTES) if votes else None
        fit = fit_far(votes, scan=True) if votes else None
        if fit is None:
            return SeamState(0.0, self._drift(stamp_s)[0], False)
        if votes.weight[fit.far].sum() >= _LEAST_FAR:
            self._votes.append(votes)
            self._steps.append((stamp_s, fit.step))
        miss = np.linalg.norm(votes.left - votes.right, axis=1)
        quality = votes.weight[miss < _AGREES_RAD].sum() / max(votes.weight.sum(), 1e-9)
        return SeamState(float(quality), *self._drift(stamp_s))

    def sharpened(self) -> tuple[Rotation, np.ndarray] | None:
        """Return the rotation that all moments together tell, and its covariance, rad^2.

        None while nothing was seen. The covariance (3, 3) is of a small rotation in the left
        optical frame.
        """
        # Another thread may look meanwhile.
        votes = tuple(self._votes)
        fit = fit_far(pooled(votes), scan=True) if votes else None
        if fit is None:
            return None
        rotation = Rotation.from_matrix(stepped(self._rotation, self._frame, fit.step))
        return rotation, self._frame @ fit.covariance @ self._frame.T

    def _drift(self, stamp_s):
        """Degrees that the last moments agree on, and whether that is to be told."""
        recent = [(at, step) for at, step in self._steps if at > stamp_s - _DRIFT_S]
        if len(recent) < _LEAST_MOMENTS:
            return np.nan, False
        steps = np.array([step for _, step in recent])
        middle = np.median(steps, axis=0)
        agree = np.linalg.norm(steps - middle, axis=1) < max(
            _AGREES_RAD, np.linalg.norm(middle) / 4
        )
        drift = float(np.linalg.norm(middle))
        lasting = recent[-1][0] - recent[0][0] > 0.75 * _DRIFT_S
        return np.degrees(drift), bool(lasting and drift > _DRIFT_RAD and agree.mean() > _STEADY)
