"""The correction of one camera: its remap table, and the mark of what it cannot see."""

import cv2
import numpy as np

from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import RemapTable
from fisheye_undistort.undistort_settings import UndistortSettings


class Correction:
    """Corrects the pictures of one camera.

    A corrected pixel is 0 exactly where the lens sees nothing and at least 1 elsewhere, so that
    whoever gets the picture knows its valid part without being told.

    Attributes
    ----------
    surface : Surface
        What the corrected pictures show.
    """

    def __init__(self, lens: Lens, settings: UndistortSettings):
        surface = settings.surface_of(lens)
        self._table = RemapTable(lens, surface, settings.interpolation, settings.tilt)
        self.surface = self._table.surface
        self._grey_floor = self._table.valid.astype(np.uint8)
        self._color_floor = cv2.merge([self._grey_floor] * 3)

    def __call__(self, image: np.ndarray, out: np.ndarray) -> None:
        """Correct a picture (height, width[, 3]) uint8 into `out`, which has the surface's size.

        Raises
        ------
        ImageFormatError
            If the picture is not of the size that the camera was calibrated for.
        """
        self._table(image, out)
        cv2.max(out, self._grey_floor if image.ndim == 2 else self._color_floor, dst=out)
