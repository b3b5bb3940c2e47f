"""The synthetic world: a town all around and a ball that bounces across bearing 0.

Where the ball is follows from the stamp alone, so pictures of one stamp fit together, in whatever
processes they are made.
"""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from fisheye_capture.ball import Ball
from fisheye_capture.town import paint_town
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface

_OVERSAMPLING = 2.0
"""Resolution of the painted town in units of the view's."""
_NARROWEST_CANVAS_PX, _WIDEST_CANVAS_PX = 64, 8192
_BLUR_PX = 0.5
"""Softness of the picture in pixels of the view, so that resampling it loses little."""
_BAND_ROWS = 64
"""Rows computed at once, which bounds the memory that float64 rays take."""


@dataclass(frozen=True)
class Scene:
    """The world that belongs to a seed."""

    seed: int = 2

    def view(
        self, source: Lens | Surface, turn: Attitude = LEVEL, gain: float = 1.0
    ) -> 'SceneView':
        """Look at the scene.

        Parameters
        ----------
        source
            A lens gives what its camera sees, 0 outside its image circle; a surface gives what
            a picture that was corrected onto it should show.
        turn
            Attitude in the world, whose z axis is bearing 0.
        gain
            Exposure.
        """
        return SceneView(self.seed, source, turn, gain)


class SceneView:
    """What a lens or a surface shows of the scene: `frame` gives it at any time."""

    def __init__(self, seed: int, source: Lens | Surface, turn: Attitude, gain: float):
        self._source, self._to_world, self._gain = source, turn.matrix.T, gain
        self._px_per_rad = source.focal_x_px if isinstance(source, Lens) else source.focal_px
        self._size = np.array([source.width, source.height])
        self._background = np.empty((*self._size[::-1], 3), np.uint8)
        self._rays = np.empty(self._background.shape, np.float32)
        around, town = _soft_town(seed, self._px_per_rad)
        for top in range(0, source.height, _BAND_ROWS):
            rows = slice(top, min(top + _BAND_ROWS, source.height))
            rays = _rays(source, rows) @ self._to_world
            pixels, _ = around.project(rays)
            x, y = np.moveaxis(pixels.astype(np.float32), -1, 0)
            band = cv2.remap(town, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_WRAP)
            seen = rays.any(axis=-1, keepdims=True)
            self._background[rows] = np.minimum(band * (seen * gain), 255)
            self._rays[rows] = rays

    def frame(self, stamp_ns: int) -> np.ndarray:
        """Return the picture (height, width, 3) uint8 BGR of a time; always a new array."""
        image = self._background.copy()
        ball = Ball.at(stamp_ns)
        patch = self._patch(ball)
        color, cover = ball.seen_along(self._rays[patch], self._px_per_rad)
        color = np.minimum(color * self._gain, 255)
        image[patch] = np.rint(image[patch] * (1 - cover) + color * cover)
        return image

    def _patch(self, ball: Ball) -> tuple[slice, slice]:
        """Rows and columns that the ball may touch; none where it is out of sight."""
        pixels, seen = self._source.project(ball.rim() @ self._to_world.T)
        pixels = pixels[seen] if seen.any() else np.zeros((1, 2))
        left, top = np.clip(np.floor(pixels.min(axis=0)), 0, self._size).astype(int)
        right, bottom = np.clip(np.ceil(pixels.max(axis=0)), 0, self._size).astype(int)
        return slice(top, bottom), slice(left, right)


def _rays(source: Lens | Surface, rows: slice) -> np.ndarray:
    """Unit rays (rows, width, 3) of a source's pixels, zeros where it sees nothing."""
    y, x = np.ogrid[rows, : source.width]
    if isinstance(source, Surface):
        rays = source.rays(x, y)
        return rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    rays, seen = source.unproject(np.stack(np.broadcast_arrays(x, y), axis=-1))
    return np.where(seen[..., None], rays, 0.0)


@lru_cache(maxsize=1)
def _soft_town(seed: int, px_per_rad: float) -> tuple[Surface, np.ndarray]:
    """Paint the town for a view's resolution and blur away what the view cannot resolve.

    The last one is kept: the cameras of a rig mostly need the same.
    """
    wanted = 2 * round(np.pi * px_per_rad * _OVERSAMPLING)
    width = min(max(wanted, _NARROWEST_CANVAS_PX), _WIDEST_CANVAS_PX)
    canvas = paint_town(width, seed)
    around = canvas.surface
    margin = 16
    wide = cv2.copyMakeBorder(canvas.picture, 0, 0, margin, margin, cv2.BORDER_WRAP)
    soft = cv2.GaussianBlur(wide, (0, 0), _BLUR_PX * around.focal_px / px_per_rad)
    return around, soft[:, margin:-margin]
