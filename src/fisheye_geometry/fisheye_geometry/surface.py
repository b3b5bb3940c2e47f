"""Projection surfaces: what a pixel of a corrected picture or of a panorama looks at.

On `cylindrical` and `equirectangular` surfaces a turn of the camera about the vertical is exactly
a shift of columns by `focal_px` times the angle; on a `rectilinear` one it is not.
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from fisheye_geometry.errors import GeometryError
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX, Lens


def _cylinder_rays(a, b):
    return np.sin(a), b, np.cos(a)


def _cylinder_point(x, y, z):
    side = np.hypot(x, z)
    return np.arctan2(x, z), np.divide(y, side, out=np.full_like(y, np.inf), where=side > 0)


def _sphere_rays(a, b):
    return np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)


def _sphere_point(x, y, z):
    return np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))


def _plane_rays(a, b):
    return a, b, np.ones_like(a)


def _plane_point(x, y, z):
    front = z > 0
    return tuple(np.divide(c, z, out=np.full_like(c, np.inf), where=front) for c in (x, y))


@dataclass(frozen=True)
class _Kind:
    """How one kind of surface maps; `a` and `b` are columns and rows in focal lengths."""

    rays: callable
    point: callable
    column: callable
    """Angle to the side, rad, to `a`."""
    row: callable
    """Angle above or below the horizon, rad, to `b`."""
    steepest_rad: float
    """No row (of a plane: no column either) is placed beyond this angle by itself."""


_KINDS = {
    'cylindrical': _Kind(_cylinder_rays, _cylinder_point, float, np.tan, np.radians(70)),
    'equirectangular': _Kind(_sphere_rays, _sphere_point, float, float, pi / 2),
    'rectilinear': _Kind(_plane_rays, _plane_point, np.tan, np.tan, np.radians(60)),
}

SURFACES = tuple(_KINDS)
_MAX_PIXELS = 50_000_000
"""Above it the maps of a single camera would take more than 300 MB."""
_LARGEST_PX = 1e6
"""No length on a picture that can be made is larger."""
SCALES = ('preserve_area', 'fit')


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

    def __post_init__(self):
        if self.kind not in _KINDS:
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
    def turns_are_shifts(self) -> bool:
        """Whether a turn about the vertical is a shift of columns."""
        return self.kind != 'rectilinear'

    def rays(self, x_px: np.ndarray, y_px: np.ndarray) -> np.ndarray:
        """Directions (..., 3) float64, of any length, at pixels (broadcast against each other)."""
        a, b = np.broadcast_arrays(
            (np.asarray(x_px, float) - self.center_x_px) / self.focal_px,
            (np.asarray(y_px, float) - self.center_y_px) / self.focal_px,
        )
        return np.stack(_KINDS[self.kind].rays(a, b), axis=-1)

    def project(self, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (..., 2) at which directions (..., 3) meet the surface, and which do (...)."""
        a, b = _KINDS[self.kind].point(*np.moveaxis(np.asarray(rays, float), -1, 0))
        seen = np.isfinite(a) & np.isfinite(b)
        x = np.where(seen, a, 0.0) * self.focal_px + self.center_x_px
        y = np.where(seen, b, 0.0) * self.focal_px + self.center_y_px
        return np.stack([x, y], axis=-1), seen

    def window(self, x_px: float, y_px: float, width: int, height: int) -> 'Surface':
        """Give the part whose upper left pixel is (x_px, y_px); it may reach past the edges."""
        return replace(
            self,
            width=width,
            height=height,
            center_x_px=self.center_x_px - x_px,
            center_y_px=self.center_y_px - y_px,
        )

    def with_focal(self, focal_px: float) -> 'Surface':
        """Give the same view, larger or smaller, so that `focal_px` is this one."""
        zoom = focal_px / self.focal_px
        return replace(
            self,
            width=round(self.width * zoom),
            height=round(self.height * zoom),
            focal_px=focal_px,
            center_x_px=(self.center_x_px + 0.5) * zoom - 0.5,
            center_y_px=(self.center_y_px + 0.5) * zoom - 0.5,
        )


def surface_for(
    lens: Lens,
    kind: str = 'cylindrical',
    *,
    scale: str = 'preserve_area',
    hfov_rad: float = 0.0,
    vfov_rad: float = 0.0,
    width: int = 0,
    height: int = 0,
) -> Surface:
    """Choose the surface on which a camera's picture is corrected.

    Parameters
    ----------
    lens
        The camera.
    kind
        One of `SURFACES`.
    scale
        `preserve_area`: `focal_px` is the lens's own in the centre and the size follows;
        `fit`: the picture keeps the size that the camera gives.
    hfov_rad, vfov_rad
        Field of view; 0: what the lens sees across the middle row and the middle column, as far
        as the surface can hold it (a cylinder 70 degrees up and down, a plane 60 to each side).
    width, height
        Size in px; 0: from the scale. A width sets `focal_px` so that `hfov_rad` fills it.

    Raises
    ------
    GeometryError
        Where the surface cannot hold what was asked.
    """
    if kind not in _KINDS:
        raise GeometryError(
            f"surface '{kind}' is not known; expected one of {', '.join(SURFACES)}"
        )
    if scale not in SCALES:
        raise GeometryError(f"scale '{scale}' is not known; expected one of {', '.join(SCALES)}")
    how = _KINDS[kind]
    if kind == 'rectilinear' and max(hfov_rad, vfov_rad) >= np.radians(170):
        raise GeometryError(
            'a rectilinear surface holds less than 170 degrees; '
            f'{np.degrees(max(hfov_rad, vfov_rad)):g} were asked'
        )
    side_limit = how.steepest_rad if kind == 'rectilinear' else pi
    left, right = _extent(
        hfov_rad,
        lens.angle_at(-0.5, lens.center_y_px),
        lens.angle_at(lens.width - 0.5, lens.center_y_px),
        side_limit,
    )
    up, down = _extent(
        vfov_rad,
        lens.angle_at(lens.center_x_px, -0.5),
        lens.angle_at(lens.center_x_px, lens.height - 0.5),
        how.steepest_rad,
    )
    columns = float(how.column(left) + how.column(right))
    rows = float(how.row(up) + how.row(down))
    if scale == 'fit':
        width, height = width or lens.width, height or lens.height
    focal_px = width / columns if width else lens.focal_x_px
    width = width or round(columns * focal_px)
    height = height or round(rows * focal_px)
    return Surface(
        kind=kind,
        width=width,
        height=height,
        focal_px=focal_px,
        center_x_px=float(how.column(left)) * focal_px - 0.5,
        center_y_px=float(how.row(up)) / rows * height - 0.5,
    )


def _extent(asked_rad: float, before_rad: float, after_rad: float, limit_rad: float):
    """Angles to either side of the axis: half of what was asked, else what the lens sees."""
    if asked_rad:
        return asked_rad / 2, asked_rad / 2
    return min(before_rad, limit_rad), min(after_rad, limit_rad)
