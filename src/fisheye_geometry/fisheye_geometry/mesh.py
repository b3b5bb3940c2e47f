"""Meshes: what changes little from pixel to pixel, computed every few pixels and interpolated.

A remap table of all pixels takes as long as many frames. Through a mesh it is there in a few
milliseconds, so that a camera that moves can have one for each frame.
"""

from copy import copy

import cv2
import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import INTERPOLATION_FLAGS, OUTSIDE_PX, on_picture
from fisheye_geometry.surface import Surface

_STEP_PX = 8
"""Pixels from node to node: a fisheye's picture on a plane bends by 0.02 px in between."""
_ALL = 1 - 1e-4
"""Share of nodes around a pixel that means all of them."""


class Mesh:
    """Nodes among the pixels of a picture, half a step beyond its edges too.

    Attributes
    ----------
    x_px, y_px : ndarray
        (1, columns) and (rows, 1) float64: where the nodes are.
    """

    def __init__(self, width: int, height: int):
        """Prepare for a picture of that size."""
        self._size = width, height
        self.x_px, self.y_px = (
            _STEP_PX * (np.arange(-1, -(-side // _STEP_PX) + 1) + 0.5) - 0.5
            for side in (width, height)
        )
        self.x_px, self.y_px = self.x_px[None], self.y_px[:, None]

    def spread(self, values: np.ndarray) -> np.ndarray:
        """Interpolate values of nodes (rows, columns[, n]) to (height, width[, n]) float32."""
        rows, columns = values.shape[:2]
        fine = cv2.resize(
            values.astype(np.float32),
            (columns * _STEP_PX, rows * _STEP_PX),
            interpolation=cv2.INTER_LINEAR,
        )
        width, height = self._size
        return fine[_STEP_PX : _STEP_PX + height, _STEP_PX : _STEP_PX + width]


class MeshTable:
    """A remap table through a mesh; as `RemapTable`, but up to a step smaller where it ends.

    Attributes
    ----------
    valid : ndarray
        (height, width) bool: where the camera sees anything.
    """

    def __init__(
        self,
        source: Lens | Surface,
        surface: Surface,
        interpolation: str,
        attitude: Attitude,
    ):
        """Compute the map; parameters as of `RemapTable`."""
        mesh = Mesh(surface.width, surface.height)
        pixels, seen = on_picture(source, surface.rays(mesh.x_px, mesh.y_px) @ attitude.matrix)
        self.valid: np.ndarray = mesh.spread(seen) > _ALL
        self._map = mesh.spread(pixels)
        if not self.valid.all():
            self._map[~self.valid] = OUTSIDE_PX
        self._flag = INTERPOLATION_FLAGS[interpolation]

    def part(self, rows: slice, columns: slice) -> 'MeshTable':
        """Return the table of a part of the surface."""
        part = copy(self)
        part.valid, part._map = self.valid[rows, columns], self._map[rows, columns]
        return part

    def __call__(self, image: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """Draw a picture (height, width[, channels]) uint8 of the source's size."""
        return cv2.remap(
            image, self._map, None, self._flag, dst=out, borderMode=cv2.BORDER_CONSTANT
        )
