"""What a lens of any model does, at points all over its picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from fisheye_core.errors import CalibrationError

_ANGLES_RAD = np.radians(np.arange(0.5, 125.0, 1.0))
_AZIMUTHS_RAD = np.radians(np.arange(0.0, 360.0, 5.0))
_COLUMNS = 60
"""Pixels to a side at which a model from pixels to rays is asked."""


@dataclass(frozen=True)
class Samples:
    """What a model says at some points of the picture.

    Attributes
    ----------
    rays, pixels
        (N, 3) and (N, 2) px.
    size
        Width and height of the picture, px.

    Raises
    ------
    CalibrationError
        If there are no points.
    """

    rays: np.ndarray
    pixels: np.ndarray
    size: tuple[int, int]

    def __post_init__(self):
        if not len(self.rays):
            raise CalibrationError('the model sees nothing of its picture')


def samples_of_projection(
    project: Callable[[np.ndarray], np.ndarray], size: tuple[int, int]
) -> Samples:
    """Ask a model for rays all around, until they leave the picture or the model ends.

    Parameters
    ----------
    project
        From rays (..., 3) to pixels (..., 2); NaN where the model has none.
    size
        Width and height, px.
    """
    angle, azimuth = np.meshgrid(_ANGLES_RAD, _AZIMUTHS_RAD)
    side = np.sin(angle)
    rays = np.stack([side * np.cos(azimuth), side * np.sin(azimuth), np.cos(angle)], axis=-1)
    with np.errstate(all='ignore'):
        pixels = project(rays)
        center = project(np.array([0.0, 0.0, 1.0]))
        radius = np.linalg.norm(pixels - center, axis=-1)
        growth = np.diff(radius, axis=1, prepend=0.0)
    inside = np.all((pixels > -0.5) & (pixels < np.array(size) - 0.5), axis=-1)
    use = np.logical_and.accumulate(growth > 0, axis=1) & inside
    # Of two samples on both sides of the curve's end the second may have the larger radius.
    use[:, :-1] &= ~(growth[:, 1:] <= 0)
    return Samples(rays[use], pixels[use], size)


def samples_of_ocam(
    polynomial: Sequence[float],
    center: tuple[float, float],
    affine: tuple[float, float, float],
    size: tuple[int, int],
) -> Samples:
    """Ask an OCam model, Scaramuzza, Martinelli and Siegwart 2006, doi 10.1109/ICVS.2006.3.

    Parameters
    ----------
    polynomial
        Depth by radius, from the constant on; its axis points out of the back of the camera.
    center, affine
        Row and column, px; c, d, e.
    size
        Width and height, px.
    """
    x, y = (np.linspace(0, side - 1, _COLUMNS) for side in size)
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    c, d, e = affine
    row, column = pixels[:, 1] - center[0], pixels[:, 0] - center[1]
    down = (row - d * column) / (c - d * e)
    right = (c * column - e * row) / (c - d * e)
    radius = np.hypot(down, right)
    ahead = -np.polynomial.polynomial.polyval(radius, polynomial)
    rays = np.stack([right, down, ahead], axis=-1)
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    use = rays[:, 2] > np.cos(_ANGLES_RAD[-1])
    return Samples(rays[use], pixels[use], size)
