"""What a picture has to hold on to: edges and texture, with exposure and smooth areas removed.

Correlating the pictures themselves says 0.9 for two views that share nothing but a bright ceiling
over a dark floor. Here only what changes along a row within a few degrees counts, equally in
bright and in dark places; a horizon, which fits at every offset, and noise count for little.
"""

from dataclasses import dataclass, replace
from math import ceil, radians

import cv2
import numpy as np

from fisheye_geometry.surface import Surface

_FEWEST_PX = 8
"""However narrow the field of view, pictures keep so many rows and columns."""
_RIM_PX = 2
"""The edge of what a lens sees is half dark."""
_SMOOTHING_PX = 1.4
_WINDOW_PX = 25
"""What changes more slowly along a row than over this width is no structure."""
_NEIGHBOURHOOD_PX = 49
"""Contrast is made equal over squares of this size."""
_NOISE_LEVEL = 3.0
"""Contrast below it is not raised, grey levels."""


@dataclass(frozen=True)
class Structure:
    """The structure of a picture, reduced in size.

    Attributes
    ----------
    image
        (h, w) float32, mostly -3 to 3, 0 where nothing is seen.
    valid
        (h, w) uint8: 1 where the lens sees something, with a margin, else 0.
    """

    image: np.ndarray
    valid: np.ndarray


@dataclass(frozen=True)
class FacingPair:
    """The structures of the facing sides of a pair of pictures, reduced by `step`.

    Attributes
    ----------
    left, right
        The structures.
    surface
        What the right one shows.
    level_y_px
        Vertical offset of the right one in the left one if the rig is level.
    step
        Pixels of the pictures to one of these.
    """

    left: Structure
    right: Structure
    surface: Surface
    level_y_px: float
    step: int

    @property
    def px_per_deg(self) -> float:
        """Pixels of these pictures to a degree in their centre."""
        return self.surface.focal_px * radians(1)


def face(
    left: np.ndarray,
    right: np.ndarray,
    surface_right: Surface,
    level_y_px: float,
    px_per_deg: float,
) -> FacingPair:
    """Find the structure of two facing parts of pictures.

    Parameters
    ----------
    left, right
        (height, width) uint8, cut from the pictures' facing sides; 0 where nothing is seen.
    surface_right
        What the right picture shows.
    level_y_px
        Vertical offset of the right picture in the left one if the rig is level.
    px_per_deg
        Resolution to reduce the pictures to; they are never enlarged.
    """
    coarsest = min(*left.shape, *right.shape) // _FEWEST_PX
    step = round(surface_right.focal_px * radians(1) / px_per_deg)
    step = max(1, min(step, coarsest))
    left, right = structure(left, step), structure(right, step)
    height, width = right.image.shape
    surface = replace(
        surface_right,
        width=width,
        height=height,
        focal_px=surface_right.focal_px / step,
        center_x_px=(surface_right.center_x_px + 0.5) / step - 0.5,
        center_y_px=(surface_right.center_y_px + 0.5) / step - 0.5,
    )
    return FacingPair(left, right, surface, level_y_px / step, step)


def structure(picture: np.ndarray, step: int) -> Structure:
    """Find the structure of a picture (height, width) uint8, reduced by `step`."""
    picture, valid = _reduce(picture, step)
    weight = valid.astype(np.float32)
    smooth = _average(picture * weight, weight, cv2.GaussianBlur, (0, 0), _SMOOTHING_PX)
    detail = (smooth - _trend(smooth * weight, weight)) * weight
    square = (_NEIGHBOURHOOD_PX, _NEIGHBOURHOOD_PX)
    contrast = _average(detail * detail, weight, cv2.blur, square)
    return Structure(detail / np.sqrt(contrast + _NOISE_LEVEL**2), valid)


def _reduce(picture, step):
    """Reduce a picture, and tell which pixels are made of seen ones only."""
    height, width = (side // step for side in picture.shape)
    picture = picture[: height * step, : width * step]
    seen = cv2.compare(picture, 0, cv2.CMP_GT)
    if step > 1:
        picture, seen = (
            cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
            for image in (picture, seen)
        )
    rim = 2 * ceil(_RIM_PX / step) + 1
    valid = cv2.erode(
        (seen == 255).astype(np.uint8),
        np.ones((rim, rim), np.uint8),
        borderType=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    return picture, valid


def _average(image, weight, smooth, *how):
    """Smooth what is seen alone: `image` is 0 where `weight` is."""
    return smooth(image, *how) / (smooth(weight, *how) + 1e-6)


def _trend(image, weight):
    """Fit a line to what is seen of each row around each pixel.

    At the rim, where a window has one side only, a mere mean would take the light that falls off
    there for structure, and rims would match rims.
    """
    x = np.arange(image.shape[1], dtype=np.float32) - image.shape[1] / 2
    total, mean_x, square_x, mean, product = (
        cv2.blur(values, (_WINDOW_PX, 1))
        for values in (weight, weight * x, weight * (x * x), image, image * x)
    )
    total += 1e-6
    mean_x /= total
    mean /= total
    spread = square_x / total - mean_x * mean_x
    slope = (product / total - mean_x * mean) / (spread + 1.0)
    return mean + slope * (x - mean_x)
