"""Projection surfaces: what a pixel of a corrected picture or of a panorama looks at.

On `cylindrical` and `equirectangular` surfaces a turn of the camera about the vertical is exactly
a shift of columns by `focal_px` times the angle; on a `rectilinear` one it is not.
"""

from dataclasses import dataclass, replace
from math import atan2, inf, pi

import numpy as np
from numpy.typing import ArrayLike

from fisheye_core.errors import GeometryError
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX
from fisheye_geometry.surface_kind import KINDS

SURFACES = tuple(KINDS)
_MAX_PIXELS = 50_000_000
"""Above it the maps of a single camera would take more than 300 MB."""
_LARGEST_PX = 1e6
"""No length on a picture that can be made is larger."""


@dataclass(frozen=True)
class Surface:
    """A picture on a projection surface.

    Attributes
    ----------
    kind
        One of `SURFACES`.
    width, height
        Size of the picture, px.
    focal_px
        Pixels per radian along x (on a rectilinear surface: pixels).
    center_x_px, center_y_px
        The pixel that looks along the axis; it may lie outside the picture.

    Raises
    ------
    GeometryError
        For a kind that is not known, and for a size or numbers with which no picture can be made.
    """

    kind: str
    width: int
    height: int
    focal_px: float
    center_x_px: float
    center_y_px: float

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise GeometryError(
                f"surface '{self.kind}' is not known; expected one of {', '.join(SURFACES)}"
            )
        if not 0 < self.focal_px <= _LARGEST_PX:
            raise GeometryError(
                f'focal_px is {self.focal_px}; expected more than 0, up to {_LARGEST_PX:g} px'
            )
        sides = self.width, self.height
        if not (
            min(sides) >= 1
            and max(sides) <= MAX_PICTURE_SIDE_PX
            and self.width * self.height <= _MAX_PIXELS
        ):
            raise GeometryError(
                f'a surface of {self.width}x{self.height} px is not possible; each side must have '
                f'1 to {MAX_PICTURE_SIDE_PX} px and all {_MAX_PIXELS / 1e6:g} million at the most '
                '(see hfov_deg, vfov_deg, width, height)'
            )
        for name in ('center_x_px', 'center_y_px'):
            if not abs(getattr(self, name)) <= _LARGEST_PX:
                raise GeometryError(
                    f'{name} is {getattr(self, name)}; expected at most {_LARGEST_PX:g} px'
                )

    @property
    def yaw_is_column_shift(self) -> bool:
        """Whether a turn about the vertical is a shift of columns."""
        return KINDS[self.kind].yaw_is_column_shift

    def rays(self, x_px: ArrayLike, y_px: ArrayLike) -> np.ndarray:
        """Directions (..., 3) float64, of any length, at pixels (broadcast against each other)."""
        a, b = np.broadcast_arrays(
            (np.asarray(x_px, float) - self.center_x_px) / self.focal_px,
            (np.asarray(y_px, float) - self.center_y_px) / self.focal_px,
        )
        return np.stack(KINDS[self.kind].rays(a, b), axis=-1)

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2) at which directions (..., 3) meet the surface, and which do (...)."""
        a, b = KINDS[self.kind].point(*np.moveaxis(np.asarray(rays, float), -1, 0))
        seen = np.isfinite(a) & np.isfinite(b)
        x = np.where(seen, a, 0.0) * self.focal_px + self.center_x_px
        y = np.where(seen, b, 0.0) * self.focal_px + self.center_y_px
        return np.stack([x, y], axis=-1), seen

    def unproject(self, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the rays (..., 3) at pixels (..., 2), and which there are: all of them."""
        pixels = np.asarray(pixels, float)
        return self.rays(pixels[..., 0], pixels[..., 1]), np.ones(pixels.shape[:-1], bool)

    def row_px(self, depression_rad: float) -> float:
        """Return the row, straight ahead, at an angle below the axis."""
        return self.center_y_px + KINDS[self.kind].row(depression_rad) * self.focal_px

    def depression_rad(self, y_px: float) -> float:
        """Return the angle below the axis of a row, straight ahead; the inverse of `row_px`."""
        _, y, z = self.rays(self.center_x_px, y_px)
        return atan2(y, z)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, px."""
        return self.width, self.height

    @property
    def circumference_px(self) -> float:
        """Columns that lead all around, px; infinite on a surface that does not."""
        return 2 * pi * self.focal_px if self.yaw_is_column_shift else inf

    def window(self, x_px: float, y_px: float, width: int, height: int) -> 'Surface':
        """Return the part whose upper left pixel is (x_px, y_px); it may reach past the edges."""
        return replace(
            self,
            width=width,
            height=height,
            center_x_px=self.center_x_px - x_px,
            center_y_px=self.center_y_px - y_px,
        )

    def with_focal(self, focal_px: float) -> 'Surface':
        """Scale the surface so that `focal_px` is this one."""
        zoom = focal_px / self.focal_px
        return replace(
            self,
            width=round(self.width * zoom),
            height=round(self.height * zoom),
            focal_px=focal_px,
            center_x_px=(self.center_x_px + 0.5) * zoom - 0.5,
            center_y_px=(self.center_y_px + 0.5) * zoom - 0.5,
        )
