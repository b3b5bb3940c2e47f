"""Local alignment by rigid moving least squares, to compare with.

After T. Ho et al., "360-degree video stitching for dual-fisheye lens cameras based on rigid moving
least squares", 2017, https://doi.org/10.1109/ICIP.2017.8296241: matched points of the overlap say
how the right view is deformed so that it lies on the left one; then they fade. The deformation is
found once, as published, or for each frame.
"""

import cv2
import numpy as np

from panorama_stitch.compose.blend import Feather

_FEATURES, _RATIO, _FEWEST = 600, 0.8, 6
_MOST_ASIDE_PX, _MOST_PARALLAX_PX = 6, 45
_STEP_PX = 8
"""The deformation is found on a grid and interpolated."""


class MovingLeastSquares:
    """A blend that deforms the right view before it fades."""

    def __init__(self, left_seen, right_seen, fade, *, each_frame: bool = False):
        """Prepare; parameters as of `Feather`."""
        self._feather = Feather(left_seen, right_seen, fade)
        self._each_frame = each_frame
        self._features = cv2.SIFT_create(_FEATURES)
        self._map: np.ndarray | None = None

    def __call__(self, left: np.ndarray, right: np.ndarray) -> None:
        """Blend into the place of the right view."""
        if self._map is None or self._each_frame:
            self._map = self._deformation(left, right)
        if self._map is not None:
            border = {'borderMode': cv2.BORDER_REPLICATE}
            right[:] = cv2.remap(right, self._map, None, cv2.INTER_LINEAR, **border)
        self._feather(left, right)

    def _deformation(self, left: np.ndarray, right: np.ndarray) -> np.ndarray | None:
        """(height, width, 2): where in the right view each pixel is; None with few matches."""
        greys = (cv2.cvtColor(view, cv2.COLOR_BGR2GRAY) for view in (left, right))
        found = [self._features.detectAndCompute(grey, None) for grey in greys]
        (ours, our_words), (theirs, their_words) = found
        if our_words is None or their_words is None:
            return None
        matches = cv2.BFMatcher().knnMatch(our_words, their_words, k=2)
        good = [m[0] for m in matches if len(m) == 2 and m[0].distance < _RATIO * m[1].distance]
        if len(good) < _FEWEST:
            return None
        at = np.float32([ours[match.queryIdx].pt for match in good])
        there = np.float32([theirs[match.trainIdx].pt for match in good])
        x, y = np.abs(at - there).T
        likely = (y < _MOST_ASIDE_PX) & (x < _MOST_PARALLAX_PX)
        if likely.sum() < _FEWEST:
            return None
        return _rigid(at[likely], there[likely], left.shape[:2])


def _rigid(at: np.ndarray, there: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Move each pixel by the rotation and shift that suit the points near it best.

    S. Schaefer et al., "Image deformation using moving least squares", 2006,
    https://doi.org/10.1145/1141911.1141920.
    """
    height, width = shape
    rows, columns = (np.arange(0, side + _STEP_PX, _STEP_PX, np.float32) for side in shape)
    nodes = np.dstack(np.meshgrid(columns, rows))
    pixels = nodes.reshape(-1, 2)
    weights = 1 / np.maximum(((pixels[:, None] - at) ** 2).sum(axis=2), 1e-3)
    weights /= weights.sum(axis=1, keepdims=True)
    middle, aim = weights @ at, weights @ there
    p, q = at - middle[:, None], there - aim[:, None]
    along = (weights * (p * q).sum(axis=2)).sum(axis=1)
    across = (weights * (p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0])).sum(axis=1)
    cos, sin = np.stack([along, across]) / np.maximum(np.hypot(along, across), 1e-9)
    x, y = (pixels - middle).T
    moved = np.stack([cos * x - sin * y, sin * x + cos * y], axis=1) + aim
    size = nodes.shape[1] * _STEP_PX, nodes.shape[0] * _STEP_PX
    fine = cv2.resize(moved.reshape(nodes.shape).astype(np.float32), size)
    # Nodes lie at multiples of the step, the middles of the pixels of which they were enlarged.
    half = _STEP_PX // 2
    return np.ascontiguousarray(fine[half : half + height, half : half + width])
