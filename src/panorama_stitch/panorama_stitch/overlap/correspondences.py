"""Features of two views that look alike, without those that move with the robot."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.overlap.features import Features

_RATIO = 0.92
"""A match whose best rival is as near is none."""
_SAME_PLACE_PX = 4.0
"""Rivals nearer than it are the same feature found twice."""
_STATIC_PX = 3.0
_SAME, _BODY_SHARE = 0.93, 0.01


@dataclass(frozen=True, eq=False)
class Correspondences:
    """Features seen in both views: (n, 3, 3) frames in either optical frame, (n,) quality."""

    left: np.ndarray
    right: np.ndarray
    quality: np.ndarray

    def __len__(self):
        return len(self.quality)


def match_features(left: Features, right: Features, *, static: bool) -> Correspondences:
    """Match features of two views.

    Parameters
    ----------
    left, right
        The features.
    static
        Whether what stays at its pixel is the robot itself, or dirt, and no match.
    """
    if not (len(left.pixels) and len(right.pixels)):
        empty = np.zeros((0, 3, 3))
        return Correspondences(empty, empty, np.zeros(0))
    likeness = left.descriptors @ right.descriptors.T
    forth, ratio = _best(likeness, right.pixels)
    back, ratio_back = _best(likeness.T, left.pixels)
    mine = np.flatnonzero(back[forth] == np.arange(len(forth)))
    theirs = forth[mine]
    quality = 1 - np.maximum(ratio[mine], ratio_back[theirs])
    keep = quality > 1 - _RATIO
    if static:
        moved = np.linalg.norm(left.pixels[mine] - right.pixels[theirs], axis=1)
        keep &= moved > _STATIC_PX
    mine, theirs, quality = mine[keep], theirs[keep], quality[keep]
    return Correspondences(left.frames[mine], right.frames[theirs], quality)


def join(parts: Sequence[Correspondences]) -> Correspondences:
    """Put the correspondences of several pairs together."""
    return Correspondences(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ('left', 'right', 'quality')
        )
    )


def _best(likeness, pixels):
    """For each row its best column, and how near the best one elsewhere comes to it."""
    count = min(4, likeness.shape[1])
    top = np.argpartition(-likeness, count - 1, axis=1)[:, :count]
    value = np.take_along_axis(likeness, top, axis=1)
    order = np.argsort(-value, axis=1)
    top, value = np.take_along_axis(top, order, 1), np.take_along_axis(value, order, 1)
    distance = np.sqrt(np.maximum(2 - 2 * value, 1e-6))
    apart = np.linalg.norm(pixels[top] - pixels[top[:, :1]], axis=-1) > _SAME_PLACE_PX
    rival = np.where(apart, distance, np.inf).min(axis=1)
    return top[:, 0], distance[:, 0] / np.where(np.isfinite(rival), rival, distance[:, 0] * 9)


def static_mask(
    left: np.ndarray, right: np.ndarray, usable: np.ndarray, side_px: int = 15
) -> np.ndarray:
    """Find what two images (height, width) uint8 of one size show alike at the same pixels.

    Parameters
    ----------
    left, right
        The images.
    usable
        (height, width) bool: where both show anything.
    side_px
        Side of the patches that are compared.

    Returns
    -------
    ndarray
        (height, width) bool.
    """
    a, b = (cv2.GaussianBlur(image.astype(np.float32), (0, 0), 1.0) for image in (left, right))
    size = (side_px, side_px)
    a, b = a - cv2.blur(a, size), b - cv2.blur(b, size)
    energy = [cv2.blur(x * x, size) for x in (a, b)]
    likeness = cv2.blur(a * b, size) / np.sqrt(energy[0] * energy[1] + 1e-3)
    same = ((likeness > _SAME) & usable & (np.minimum(*energy) > 25.0)).astype(np.uint8)
    # Edges of the scene may fall on one another by chance; a body is larger.
    _, labels, stats, _ = cv2.connectedComponentsWithStats(same)
    large = stats[:, cv2.CC_STAT_AREA] > _BODY_SHARE * same.size
    large[0] = False
    return cv2.dilate(large[labels].astype(np.uint8), np.ones(size, np.uint8)) > 0
