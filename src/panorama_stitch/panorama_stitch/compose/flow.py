"""Flow: near things, which two cameras see in two places, made whole in the overlap.

From its left edge, where the picture is the left camera's, to its right edge the overlap is seen
from a place that wanders from the left camera to the right one: each view is warped along the
disparity between them by its share (S. E. Chen, L. Williams, "View interpolation for image
synthesis", 1993, https://doi.org/10.1145/166117.166153). In the middle both show the same, and one
fades into the other.
"""

import cv2
import numpy as np

from fisheye_core.parallel import run_parallel
from panorama_stitch.compose.blend import Alone, Feather
from panorama_stitch.compose.disparity import Disparity
from panorama_stitch.compose.ramp import Fading, columns_of, ramp_over

_ROUNDS = 3
"""Of the fixed point that finds what part of a view comes to lie at a pixel."""
_DOUBT, _TRUST = 0.45, 0.55
"""Shares of what differs in which the views agree: below the one all of it is wrong, above the
other it is right; between them all stays as it is."""
_LEAST_COUNT = 0.02
"""Share of the overlap that agrees in any case: where little differs it counts little."""
_TRUST_PER_FRAME = 0.05
"""Share of the way to its new value that the trust goes at once, and most change of the warp."""
_EDGE_SIDES, _ROUNDING = (9, 3), 1e-3
_EDGE_ROWS = 5
"""Over so many reduced rows the edges of an overlap are evened out."""


class Flow:
    """Warps two views until they meet, and fades from one into the other.

    What can be seen by one camera only has no flow. Where that is most of what the overlap shows,
    as with things nearer than a few times the distance between the lenses, flow is wrong all over
    it: the views fade unwarped. All rows do so together, so that what stands upright stays
    straight, and slowly, so that nothing flickers.
    """

    is_local, needs_overlap = False, True

    def __init__(
        self,
        left_seen: np.ndarray,
        right_seen: np.ndarray,
        fade: Fading = None,
    ):
        """Prepare; parameters as of `Feather`, the views warp in all columns."""
        height, width = shape = left_seen.shape
        self._feather = Feather(left_seen, right_seen, fade)
        self._alone = Alone(left_seen, right_seen)
        ramp = ramp_over(shape, fade)
        self._fade = slice(*columns_of(ramp))
        fading = ramp[:, self._fade]
        self._weights = [np.ascontiguousarray(weight) for weight in (1 - fading, fading)]

        self._disparity = disparity = Disparity(width, height)
        both = disparity.reduced((left_seen & right_seen).astype(np.float32))
        way = _way(both > 0.5)
        self._left = _Warp(disparity, way, shape, slice(0, self._fade.stop))
        self._right = _Warp(disparity, 1 - way, shape, slice(self._fade.start, width))
        # What one view does not show must not be drawn to where both show something.
        inside = cv2.erode(np.floor(both + _ROUNDING), np.ones(_EDGE_SIDES[::-1]))
        self._strength = cv2.blur(inside, _EDGE_SIDES)
        self._used = np.empty_like(self._strength)
        self._judged = (both > 0.5).astype(np.uint8)
        self._agrees, self._counts = np.empty((2, *both.shape), np.uint8)
        self._trust, self._is_trusted, self._warped = np.nan, False, 0.0

    def __call__(
        self,
        left: np.ndarray,
        right: np.ndarray,
        rows: slice = slice(None),
        *,
        economical: bool = False,
    ) -> None:
        """As `Blend`."""
        if economical:
            # It warps more and more again.
            self._warped = 0.0
            self._feather(left, right)
            return
        self._alone.fill(left, right)
        self._disparity.follow(left, right)
        strength = np.multiply(self._strength, np.float32(self._how_far()), out=self._used)
        ours, theirs = self._left, self._right
        there, back = self._disparity.there, self._disparity.back
        run_parallel(
            [
                lambda: ours.draw(left, there, strength),
                lambda: theirs.draw(right, back, strength),
            ]
        )
        fade, width = self._fade, self._fade.stop - self._fade.start
        right[:, : fade.start] = ours.drawn[:, : fade.start]
        right[:, fade.stop :] = theirs.drawn[:, width:]
        if width:
            faded = ours.drawn[:, fade], theirs.drawn[:, :width]
            cv2.blendLinear(*faded, *self._weights, dst=right[:, fade])

    def _how_far(self) -> float:
        """How far the views are warped now, 0 to 1."""
        agrees, counts = self._agrees, self._counts
        self._disparity.judge(agrees, counts)
        agrees &= self._judged
        counts &= self._judged
        few = _LEAST_COUNT * cv2.countNonZero(self._judged) + 1e-6
        share = (cv2.countNonZero(agrees) + few) / (cv2.countNonZero(counts) + few)
        if np.isnan(self._trust):
            self._trust, self._is_trusted = share, share > _TRUST
            self._warped = float(self._is_trusted)
        self._trust += _TRUST_PER_FRAME * (share - self._trust)
        self._is_trusted = self._trust > (_DOUBT if self._is_trusted else _TRUST)
        change = self._is_trusted - self._warped
        self._warped += np.clip(change, -_TRUST_PER_FRAME, _TRUST_PER_FRAME)
        return self._warped


def _way(both: np.ndarray) -> np.ndarray:
    """How far on the way from the left camera to the right one each pixel is seen from, 0 to 1.

    In each row it leads from the first pixel to the last one that both show.
    """
    height, width = both.shape
    rows = np.flatnonzero(both.any(axis=1))
    if not len(rows):
        return np.zeros(both.shape, np.float32)
    first, last = both.argmax(axis=1), width - both[:, ::-1].argmax(axis=1)
    edges = []
    for edge in (first, last):
        edge = np.interp(np.arange(height), rows, edge[rows]).astype(np.float32)
        edges.append(cv2.blur(edge[:, None], (1, _EDGE_ROWS)).reshape(height, 1))
    begin, end = edges
    columns = np.arange(width, dtype=np.float32) + 0.5
    return ((columns - begin) / np.maximum(end - begin, 1)).clip(0, 1)


class _Warp:
    """Draws one view from between the cameras.

    Attributes
    ----------
    drawn : ndarray
        The columns that were asked for.
    """

    def __init__(
        self, disparity: Disparity, part: np.ndarray, shape: tuple[int, int], columns: slice
    ):
        """Prepare for a `part` (disparity's height, width) of the way to the other view."""
        self.drawn = np.empty(0, np.uint8)
        self._disparity = disparity
        self._back = -part
        self._columns = columns
        self._at, self._moved = np.empty((2, *part.shape), np.float32)
        height, width = shape
        self._scale = self._back * np.float32(width / disparity.width)
        sides = np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32)
        self._x, rows = np.meshgrid(*sides)
        self._rows = np.ascontiguousarray(rows[:, columns])
        self._map = np.empty(shape, np.float32)

    def draw(self, image: np.ndarray, moved: np.ndarray, strength: np.ndarray) -> None:
        """Draw a view, moved by its part of the way from it, as far as strength (0 to 1) says."""
        whole, at = moved, self._at
        for _ in range(_ROUNDS):
            np.multiply(self._back, moved, out=at)
            at += self._disparity.columns
            self._disparity.sample(whole, at, self._moved)
            moved = self._moved
        moved *= self._scale
        moved *= strength
        cv2.resize(moved, self._map.shape[::-1], dst=self._map, interpolation=cv2.INTER_LINEAR)
        where = self._map[:, self._columns]
        cv2.add(where, self._x[:, self._columns], dst=where)
        shape = where.shape + image.shape[2:]
        if self.drawn.shape != shape:
            self.drawn = np.empty(shape, np.uint8)
        if not self.drawn.size:
            return
        border = {'borderMode': cv2.BORDER_REPLICATE}
        cv2.remap(image, where, self._rows, cv2.INTER_LINEAR, dst=self.drawn, **border)
