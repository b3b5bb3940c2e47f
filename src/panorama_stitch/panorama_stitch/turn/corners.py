"""Corners of the scene, followed from picture to picture."""

import cv2
import numpy as np

_MOST = 500
APART_WIDTHS = 1 / 50
"""Distance of corners, in widths of the picture."""
QUALITY = 0.003
_WINDOW_PX = 15
_LEVELS = 4
_STILL_PX = 0.8
"""What moves less while the scene moves is the robot itself, or dirt."""
_RETURN_PX = 0.4
"""Followed there and back again, a corner must come this near to where it was."""
_DARK_LEVEL = 16
"""Below it the sensor is not lit."""


class Corners:
    """Corners of one camera, where the last picture that was kept shows them.

    Attributes
    ----------
    points
        (n, 2) float32, px.
    ids
        (n,) int.
    """

    def __init__(self):
        self.points = np.zeros((0, 2), np.float32)
        self.ids = np.zeros(0, int)
        self._next = 0
        self._brightest: np.ndarray | None = None
        self._guess = self.points
        self._good = np.zeros(0, bool)
        self._still = self.points

    def follow(self, before: np.ndarray, picture: np.ndarray) -> float:
        """Find the corners in another picture; return by how much the scene moved, px."""
        if not len(self.points):
            return 0.0
        self._guess, self._good = followed(before, picture, self.points, self._guess)
        moved = np.linalg.norm(self._guess - self.points, axis=1)[self._good]
        # A body that fills half of the picture stands still.
        return float(np.percentile(moved, 75)) if len(moved) else 0.0

    def settle(self) -> int:
        """Move the corners to where they were found; return how many are left."""
        moved = np.linalg.norm(self._guess - self.points, axis=1)
        kept = self._good & (moved > _STILL_PX)
        self._still = self.points[self._good & ~kept]
        self.points, self.ids = self._guess[kept], self.ids[kept]
        return len(self.ids)

    def fill(self, picture: np.ndarray) -> None:
        """Add new corners where there are none."""
        if self._brightest is None:
            self._brightest = np.zeros_like(picture)
        self._brightest = np.maximum(self._brightest, picture)
        mask = lit(self._brightest)
        apart = max(4, round(picture.shape[1] * APART_WIDTHS))
        for x, y in np.concatenate([self.points, self._still]):
            cv2.circle(mask, (round(x), round(y)), apart, 0, -1)
        wanted = _MOST - len(self.points)
        found = None
        if wanted > 0:
            even = cv2.createCLAHE(2.0, (8, 8)).apply(picture)
            found = cv2.goodFeaturesToTrack(even, wanted, QUALITY, apart, mask=mask)
        new = np.zeros((0, 2), np.float32) if found is None else found.reshape(-1, 2)
        self.points = np.concatenate([self.points, new])
        self.ids = np.concatenate([self.ids, self._next + np.arange(len(new))])
        self._next += len(new)
        self._guess = self.points.copy()


def followed(
    before: np.ndarray, after: np.ndarray, points: np.ndarray, guess: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Follow points (n, 2) float32 from one picture to another, there and back.

    Returns
    -------
    found : ndarray
        (n, 2) float32 in the other picture.
    good : ndarray
        (n,) bool: which of them came back to where they began.
    """
    if not len(points):
        return points, np.zeros(0, bool)
    # A camera that changes its exposure must not look as if the scene changed.
    after = cv2.convertScaleAbs(after, alpha=before.mean() / max(float(after.mean()), 1.0))
    options = {
        'winSize': (_WINDOW_PX, _WINDOW_PX),
        'maxLevel': _LEVELS,
        'flags': cv2.OPTFLOW_USE_INITIAL_FLOW,
    }
    there, ok, _ = cv2.calcOpticalFlowPyrLK(before, after, points, guess.copy(), **options)
    back, ok_back, _ = cv2.calcOpticalFlowPyrLK(after, before, there, points.copy(), **options)
    good = (ok & ok_back).ravel().astype(bool)
    return there, good & (np.linalg.norm(back - points, axis=1) < _RETURN_PX)


def lit(brightest: np.ndarray) -> np.ndarray:
    """Mark where corners may be, (height, width) uint8: away from what no light reaches."""
    light = (cv2.blur(brightest, (5, 5)) > _DARK_LEVEL).astype(np.uint8)
    return cv2.erode(
        light,
        np.ones((_WINDOW_PX, _WINDOW_PX), np.uint8),
        borderType=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
