"""One camera's image and what it is known to look at: where directions are seen, and sampled."""

from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface

_RIM_PX = 3
"""Pixels along the edge of what is seen that are half black."""
_HOLE_PX = 7
"""Black spots smaller than it are dark pixels, not the outside of the image circle."""


def grey_of(image: np.ndarray) -> np.ndarray:
    """Return the grey levels (height, width) of a grey or BGR image."""
    if image.ndim == 2:
        return image
    if image.shape[2] == 1:
        return image[..., 0]
    return cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)


def seen_grey_of(image: np.ndarray) -> np.ndarray:
    """Return the same of a corrected image, still 0 exactly where nothing is seen."""
    grey = grey_of(image)
    if image.ndim == 2:
        return grey
    # A dark pixel that is seen, (1, 0, 0), must not become 0.
    return np.maximum(grey, image.max(axis=2) > 0)


@dataclass(frozen=True, eq=False)
class OverlapView:
    """An image with its camera model.

    Attributes
    ----------
    image
        (height, width[, 3]) uint8, grey or BGR; 0 where nothing is seen.
    model
        What its pixels look at.
    mask
        (height, width) bool: True where the camera sees its own robot; None: nowhere.
    """

    image: np.ndarray
    model: Lens | Surface
    mask: np.ndarray | None = None

    @cached_property
    def grey(self) -> np.ndarray:
        """(height, width) uint8."""
        return grey_of(self.image)

    @cached_property
    def usable(self) -> np.ndarray:
        """(height, width) uint8: 255 where the image shows the scene, 0 elsewhere."""
        kernel = np.ones((_HOLE_PX, _HOLE_PX), np.uint8)
        lit = cv2.morphologyEx(cv2.compare(self.grey, 0, cv2.CMP_GT), cv2.MORPH_CLOSE, kernel)
        if self.mask is not None:
            lit[self.mask] = 0
        rim = np.ones((2 * _RIM_PX + 1, 2 * _RIM_PX + 1), np.uint8)
        return cv2.erode(lit, rim, borderType=cv2.BORDER_CONSTANT, borderValue=0)

    @property
    def reach_rad(self) -> float:
        """Largest angle from the optical axis at which anything is seen."""
        height, width = self.grey.shape
        rows, columns = np.linspace(0, height - 1, 64), np.linspace(0, width - 1, 64)
        edge = np.concatenate(
            [np.stack([columns, np.full(64, y)], -1) for y in (0, height - 1)]
            + [np.stack([np.full(64, x), rows], -1) for x in (0, width - 1)]
        )
        rays, seen = self.model.unproject(edge)
        angle = np.arctan2(np.hypot(rays[:, 0], rays[:, 1]), rays[:, 2])
        if seen.all():
            return float(angle.max())
        return float(getattr(self.model, 'max_angle_rad', np.pi))

    @property
    def density(self) -> float:
        """Pixels per radian in the centre."""
        return float(getattr(self.model, 'focal_px', 0) or self.model.focal_x_px)

    def sample(self, rays: np.ndarray, usable: np.ndarray | None = None, smooth_px: float = 0.0):
        """Return what is seen in directions.

        Parameters
        ----------
        rays
            (h, w, 3) in the camera's optical frame.
        usable
            As `usable`, with more taken away; None: as it is.
        smooth_px
            Standard deviation of the blur that keeps a coarser sampling from aliasing, px.

        Returns
        -------
        image : ndarray
            (h, w) uint8.
        valid : ndarray
            (h, w) bool; False where nothing usable is seen, and `image` means nothing.
        """
        pixels, seen = self.model.project(rays)
        pixels = np.where(seen[..., None], pixels, -9.0).astype(np.float32)
        image = cv2.remap(self._blurred(smooth_px), pixels, None, cv2.INTER_LINEAR)
        usable = self.usable if usable is None else usable
        return image, cv2.remap(usable, pixels, None, cv2.INTER_NEAREST) > 0

    def _blurred(self, smooth_px: float) -> np.ndarray:
        """The grey image, blurred; the last one is kept for the next proposal."""
        if smooth_px <= 0.5:
            return self.grey
        if smooth_px not in self._last_blurred:
            self._last_blurred.clear()
            self._last_blurred[smooth_px] = cv2.GaussianBlur(self.grey, (0, 0), smooth_px)
        return self._last_blurred[smooth_px]

    @cached_property
    def _last_blurred(self) -> dict[float, np.ndarray]:
        return {}
