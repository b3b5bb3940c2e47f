"""One camera's view: what its pictures show, and how they are drawn on a panorama's surface."""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Any, Protocol

import numpy as np

from fisheye_core.errors import ImageFormatError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import RemapTable, remap_table
from fisheye_geometry.surface import Surface

Cut = Callable[..., Any]
"""Draws a part of a panorama: takes the camera's image and, if given, the array for it."""


class Table(Protocol):
    """Draws what a surface shows of a view.

    Attributes
    ----------
    valid
        (height, width) bool: where it shows anything.
    """

    valid: np.ndarray

    def part(self, rows: slice, columns: slice) -> 'Table':
        """Prepare to draw a part of it."""

    def __call__(self, image: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """Draw the camera's image."""


_STEEP_RAD = np.radians(60)
"""A camera that looks up or down by more has no sides."""
_SAME_FOCAL_PX = 1e-6


@dataclass(frozen=True, eq=False)
class View:
    """How one camera's pictures are drawn.

    Attributes
    ----------
    source
        What the pictures show: a lens's view, or a surface if they are corrected already.
    surface
        The corrected picture of the camera alone: it says how much of what the camera sees is
        wanted, and the first one of a rig which surface and scale the panorama has.
    interpolation
        One of `fisheye_geometry.remap.INTERPOLATIONS`.
    attitude
        Takes rays of the source to rays of the panorama.
    shift_px
        How far to the right and down the picture is moved once it is drawn.
    seen
        (source height, source width) bool: where the pictures show anything; None for everywhere.
    body
        Likewise: where they show the robot itself; None for nowhere.
    """

    source: Lens | Surface
    surface: Surface
    interpolation: str = 'linear'
    attitude: Attitude = LEVEL
    shift_px: tuple[float, float] = (0.0, 0.0)
    seen: np.ndarray | None = None
    body: np.ndarray | None = None

    def corrected(self, image: np.ndarray) -> np.ndarray:
        """Correct a whole picture; exactly 0 where nothing is seen and nowhere else."""
        if self.source == self.surface and self.attitude == LEVEL:
            return image
        table = remap_table(self.source, self.surface, self.interpolation, self.attitude)
        corrected, valid = table(image), table.valid
        floor = valid if image.ndim == 2 else np.repeat(valid[..., None], image.shape[2], axis=2)
        return np.maximum(corrected, floor, out=corrected)

    def drawn_on(self, surface: Surface) -> Table:
        """Prepare to draw what a surface, perhaps a window of the panorama's, shows of the view.

        Corrected pictures of the same scale are copied, to whole pixels.
        """
        surface = surface.window(-self.shift_px[0], -self.shift_px[1], *surface.size)
        place = self._copied_to(surface)
        if place:
            return Copy(*place, surface.size, self.source)
        return RemapTable(self.source, surface, self.interpolation, self.attitude)

    def field_rad(self) -> tuple[float, float, float, float]:
        """Return how far the wanted picture reaches to the left, right, up and down, rad.

        The sides are those of the panorama: what a camera that lies on its side has to its left
        is up or down. To the sides it is wanted as far as it sees, and so is what a camera that
        looks straight up or down has around it.
        """
        left, right, up, down = self.own_field_rad()
        if abs(self.attitude.pitch_rad) > _STEEP_RAD:
            left = right = pi
        turned = {
            0: (left, right, up, down),
            1: (pi, pi, left, right),
            2: (right, left, down, up),
            3: (pi, pi, right, left),
        }
        return turned[round(self.attitude.roll_rad / (pi / 2)) % 4]

    def own_field_rad(self) -> tuple[float, float, float, float]:
        """Likewise, of an upright camera."""
        surface = self.surface
        x, y, focal_px = surface.center_x_px, surface.center_y_px, surface.focal_px
        to_sides = np.array([x + 0.5, surface.width - 0.5 - x])
        sides = np.minimum(to_sides / focal_px, pi)
        if not surface.yaw_is_column_shift:
            rays = surface.rays(x + to_sides, y)
            sides = np.arctan2(rays[:, 0], rays[:, 2])
        rays = surface.rays(x, np.array([-0.5, surface.height - 0.5]))
        up, down = np.arctan2(rays[:, 1], rays[:, 2]) * (-1, 1)
        return float(sides[0]), float(sides[1]), float(up), float(down)

    def shows(self, table: 'Table') -> np.ndarray:
        """(height, width) bool: where a table of this view shows anything."""
        return table.valid if self.seen is None else shown(self.seen, table, table.valid.shape)

    def shows_scene(self, table: 'Table') -> np.ndarray:
        """(height, width) bool: where a table of this view shows anything but the robot itself."""
        valid, body = self.shows(table), self.shows_body(table)
        return valid if body is None else valid & ~body

    def shows_body(self, table: 'Table') -> np.ndarray | None:
        """(height, width) bool: where a table of this view may show the robot; None: nowhere."""
        return None if self.body is None else ~shown(~self.body, table, table.valid.shape)

    def _copied_to(self, surface: Surface) -> tuple[int, int] | None:
        """Upper left pixel of the source that a surface begins with; None if pixels are mixed."""
        source, yaw_rad = self.source, self.attitude.yaw_rad
        if not isinstance(source, Surface) or source.kind != surface.kind:
            return None
        if abs(source.focal_px - surface.focal_px) * source.width > _SAME_FOCAL_PX * 1e3:
            return None
        if not self.attitude.is_pure_yaw or (yaw_rad and not source.yaw_is_column_shift):
            return None
        x = source.center_x_px - surface.center_x_px - yaw_rad * source.focal_px
        around = source.circumference_px
        if source.yaw_is_column_shift:
            # Of the places that a whole turn apart, the one nearest to the picture.
            middle = x + (surface.width - source.width) / 2
            x -= around * round(middle / around)
        return round(x), round(source.center_y_px - surface.center_y_px)


def shown(seen: np.ndarray, cut: Cut, shape: tuple[int, int]) -> np.ndarray:
    """(height, width) bool: where a cut of that shape shows only what is seen in a source."""
    drawn = np.empty(shape, np.uint8)
    cut(seen.astype(np.uint8) * 255, drawn)
    return drawn == 255


class Copy:
    """Draws a rectangle of a corrected picture; what lies outside of it is 0."""

    def __init__(self, x_px: int, y_px: int, size: tuple[int, int], source: Lens | Surface):
        width, height = size
        left, top = min(max(0, -x_px), width), min(max(0, -y_px), height)
        right = max(left, min(width, source.width - x_px))
        bottom = max(top, min(height, source.height - y_px))
        self._at = x_px, y_px
        self._to = np.s_[top:bottom, left:right]
        self._from = np.s_[top + y_px : bottom + y_px, left + x_px : right + x_px]
        self._is_whole = (left, top, right, bottom) == (0, 0, width, height)
        self._source = source
        self.valid = np.zeros((height, width), bool)
        self.valid[self._to] = True

    def part(self, rows: slice, columns: slice) -> 'Copy':
        """Prepare to draw a part of the rectangle."""
        x, y = self._at
        size = columns.stop - columns.start, rows.stop - rows.start
        return Copy(x + columns.start, y + rows.start, size, self._source)

    def __call__(self, image: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
        """Draw, as a `RemapTable` does."""
        size = self._source.width, self._source.height
        if image.shape[1::-1] != size:
            raise ImageFormatError(
                'the picture has {}x{} px; its projection is of {}x{} px'.format(
                    *image.shape[1::-1], *size
                )
            )
        if out is None:
            out = np.empty(self.valid.shape + image.shape[2:], image.dtype)
        if not self._is_whole:
            out[:] = 0
        out[self._to] = image[self._from]
        return out
