"""The image circle: how far a fisheye lens really lights the sensor, seen in its pictures."""

import cv2
import numpy as np

from fisheye_geometry.lens import Lens

_DARK_LEVEL = 16
"""An unlit sensor stays below it, but for a few noisy pixels; grey levels."""
_LIT, _UNLIT = 0.5, 0.15
"""Shares of brighter pixels in the last ring of the circle and in all rings beyond its edge."""
_RING_RAD = np.radians(0.4)
_EDGE_RINGS = 3
"""Rings that the edge of the circle may blur."""
_CUT = 0.02
"""Share of a picture: more of it than that is lit where the lens maps nothing."""
_COLUMNS = 640
"""Columns that are enough to measure the circle."""
_GRID = 48
"""Points to a side at which a lens is asked; between them angles are interpolated."""


class ImageCircle:
    """Finds the angle beyond which a lens leaves its pictures dark all around.

    Only a sharp edge all around counts, so that a lamp at night is no circle; and what was once
    seen lit is never taken for dark again.

    Attributes
    ----------
    angle_rad : float
        Radius of the circle, rad; the lens's `max_angle_rad` where none was found.
    is_cut : bool
        Whether pictures were lit where the lens maps nothing: its distortion ends too early.
    """

    def __init__(self, lens: Lens):
        self._lens = lens
        self._step = max(1, lens.width // _COLUMNS)
        angle = _angles(lens, self._step)
        self._ring = np.where(angle >= 0, angle // _RING_RAD, 0).astype(np.intp).ravel()
        self._pixels = np.bincount(self._ring)
        self._unseen = np.isnan(angle).ravel()
        self._found = False
        self.is_cut = False
        self.angle_rad = lens.max_angle_rad

    def look(self, image: np.ndarray) -> bool:
        """Learn from a picture (height, width[, channels]); whether `angle_rad` changed."""
        if image.shape[:2] != (self._lens.height, self._lens.width):
            return False
        image = image[:: self._step, :: self._step]
        # One channel is enough, and green has the least noise.
        bright = (image if image.ndim == 2 else image[..., 1]) > _DARK_LEVEL
        bright = bright.ravel()
        self.is_cut = self.is_cut or bright[self._unseen].sum() > _CUT * bright.size
        lit = np.bincount(self._ring, bright) / np.maximum(self._pixels, 1)
        rings = np.flatnonzero(lit >= _LIT)
        if not len(rings):
            return False
        last = rings[-1]
        beyond = lit[last + 1 + _EDGE_RINGS :][self._pixels[last + 1 + _EDGE_RINGS :] > 0]
        is_circle = len(beyond) and beyond.max() < _UNLIT
        angle = (last + 1) * _RING_RAD if is_circle else self._lens.max_angle_rad
        if (self._found or not is_circle) and angle <= self.angle_rad + _RING_RAD:
            return False
        self._found = self._found or bool(is_circle)
        self.angle_rad = float(min(angle, self._lens.max_angle_rad))
        return True


def _angles(lens: Lens, step: int) -> np.ndarray:
    """Angle from the axis of every `step`-th row and column, rad; NaN where nothing is seen."""
    y, x = (np.arange(0, side, step, dtype=np.float32) for side in (lens.height, lens.width))
    grid_y, grid_x = (np.linspace(0, s[-1], min(len(s), _GRID), dtype=float) for s in (y, x))
    coarse = _angles_at(lens, np.stack(np.meshgrid(grid_x, grid_y), axis=-1))
    at = np.meshgrid(*(s / max(s[-1], 1) * (min(len(s), _GRID) - 1) for s in (x, y)))
    angles = cv2.remap(coarse, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    # Where the lens ends between the points, each pixel is asked for.
    known = np.isfinite(coarse).astype(np.float32)
    share = cv2.remap(known, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    row, column = np.nonzero(np.isnan(angles) & (share > 0))
    angles[row, column] = _angles_at(lens, np.stack([x[column], y[row]], axis=-1))
    return angles


def _angles_at(lens: Lens, pixels: np.ndarray) -> np.ndarray:
    """Angle from the axis at pixels (..., 2), rad; NaN where nothing is seen."""
    rays, seen = lens.unproject(pixels)
    return np.where(seen, np.arccos(rays[..., 2].clip(-1, 1)), np.nan).astype(np.float32)


class LensWithImageCircle:
    """A lens as far as its light reaches in the pictures that came.

    The circle does not change: it is looked for in the first picture, the second, the fourth, ...
    """

    def __init__(self, lens: Lens):
        self._lens = lens
        self._circle = ImageCircle(lens)
        self._pictures = 0

    @property
    def lens(self) -> Lens:
        """The lens within its circle."""
        return self._lens.with_max_angle(self._circle.angle_rad)

    @property
    def note(self) -> str:
        """What a user should know of the lens; '' for nothing."""
        if not self._circle.is_cut:
            return ''
        end_deg = np.degrees(self._lens.max_angle_rad)
        return (
            f'the distortion of the lens ends {end_deg:.1f} degrees off its axis, where the '
            f'pictures go on: they are cut to {2 * end_deg:.0f} degrees; calibrate with views '
            'that reach the edge'
        )

    def look(self, image: np.ndarray) -> bool:
        """Learn from the next picture (height, width[, channels]); whether `lens` may be news."""
        self._pictures += 1
        is_due = self._pictures & (self._pictures - 1) == 0
        if not self._lens.has_image_circle:
            return self._pictures == 1
        return is_due and (self._circle.look(image) or self._pictures == 1)
