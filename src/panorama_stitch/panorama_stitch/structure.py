"""What a picture has to hold on to: edges and texture, with exposure and smooth areas removed.

Correlating the pictures themselves says 0.9 for two views that share nothing but a bright ceiling
over a dark floor. Here only what changes along a row within a few pixels counts, equally in bright
and in dark places; a horizon, which fits at every offset, and mere noise count for little.
"""

from dataclasses import dataclass

import cv2
import numpy as np

_SMOOTHING_PX = 0.7
_WINDOW_PX = 17
"""What changes more slowly along a row than over this width is no structure."""
_NEIGHBOURHOOD_PX = 33
"""Contrast is made equal over squares of this size."""
_NOISE_LEVEL = 3.0
"""Contrast below it is not raised, grey levels after reduction."""


@dataclass(frozen=True)
class Structure:
    """The structure of a picture.

    Attributes
    ----------
    detail
        (h, w) float32, mostly -3 to 3, 0 where `valid` is.
    valid
        (h, w) uint8: 1 where the lens sees something, with a margin, else 0.
    """

    detail: np.ndarray
    valid: np.ndarray


def structure(picture: np.ndarray, step: int) -> Structure:
    """Find the structure of a picture (height, width) uint8, reduced to 1 / `step` in size."""
    picture, valid = _reduce(picture, step)
    weight = valid.astype(np.float32)
    smooth = _average(picture * weight, weight, cv2.GaussianBlur, (0, 0), _SMOOTHING_PX)
    detail = smooth - _average(smooth * weight, weight, cv2.blur, (_WINDOW_PX, 1))
    detail *= weight
    square = (_NEIGHBOURHOOD_PX, _NEIGHBOURHOOD_PX)
    contrast = _average(detail * detail, weight, cv2.blur, square)
    valid = cv2.erode(
        valid, np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0
    )
    return Structure(detail * valid / np.sqrt(contrast + _NOISE_LEVEL**2), valid)


def plain(picture: np.ndarray, step: int) -> Structure:
    """Give a picture itself, reduced and a little smoothed."""
    picture, valid = _reduce(picture, step)
    weight = valid.astype(np.float32)
    return Structure(_average(picture * weight, weight, cv2.GaussianBlur, (0, 0), 1.0) * weight, valid)


def _reduce(picture, step):
    """Reduce a picture to float32, and tell which pixels are made of valid ones only."""
    height, width = (side // step for side in picture.shape)
    picture = picture[: height * step, : width * step]
    seen = cv2.compare(picture, 0, cv2.CMP_GT)
    if step > 1:
        picture, seen = (
            cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
            for image in (picture, seen)
        )
    return picture.astype(np.float32), (seen == 255).astype(np.uint8)


def _average(image, weight, smooth, *how):
    """Smooth what is seen alone: `image` is 0 where `weight` is."""
    return smooth(image, *how) / (smooth(weight, *how) + 1e-6)
