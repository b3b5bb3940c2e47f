"""The image circle: how far a fisheye lens really lights the sensor, seen in its pictures."""

import numpy as np

from fisheye_geometry.lens import Lens

_DARK_LEVEL = 16
"""Brighter than the noise of an unlit sensor, grey levels."""
_LIT_SHARE = 0.02
"""A ring with a larger share of pixels above `_DARK_LEVEL` lies inside the circle."""
_RINGS = 400
_SAMPLES = 640
"""Columns that are enough to measure the circle."""


def lit_angle(lens: Lens, image: np.ndarray) -> float:
    """Find the angle from the axis beyond which a picture is dark all around.

    Night looks like a small circle: take the largest of several pictures.

    Parameters
    ----------
    lens
        The camera that took it.
    image
        (height, width[, channels]) uint8 of the lens's size.

    Returns
    -------
    float
        rad, `lens.max_angle_rad` at most: equal to it where the light reaches the corners.
    """
    step = max(1, lens.width // _SAMPLES)
    image = image[::step, ::step]
    brightness = image if image.ndim == 2 else image.max(axis=2)
    y, x = np.ogrid[0 : lens.height : step, 0 : lens.width : step]
    rays, seen = lens.unproject(np.stack(np.broadcast_arrays(x, y), axis=-1))
    angle = np.where(seen, np.arccos(rays[..., 2].clip(-1, 1)), np.inf)
    edges = np.linspace(0, lens.max_angle_rad, _RINGS + 1)
    pixels, _ = np.histogram(angle, edges)
    lit, _ = np.histogram(angle[brightness > _DARK_LEVEL], edges)
    rings = np.flatnonzero(lit > _LIT_SHARE * np.maximum(pixels, 1))
    outermost = edges[rings[-1] + 1] if len(rings) else 0.0
    present = edges[np.flatnonzero(pixels)[-1] + 1]
    return lens.max_angle_rad if outermost >= present else float(outermost)
