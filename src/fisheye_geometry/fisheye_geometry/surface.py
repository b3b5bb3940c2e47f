"""Projection surfaces: what a pixel of a corrected picture or of a panorama looks at.

On `cylindrical` and `equirectangular` surfaces a turn of the camera about the vertical is exactly
a shift of columns by `focal_px` times the angle; on a `rectilinear` one it is not.
"""

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np
from numpy.typing import ArrayLike

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX, Lens
from fisheye_geometry.surface_kind import KINDS

SURFACES = tuple(KINDS)
_MAX_PIXELS = 50_000_000
"""Above it the maps of a single camera would take more than 300 MB."""
_LARGEST_PX = 1e6
"""No length on a picture that can be made is larger."""
_SAMPLES = 3601
"""Directions in which a turned camera is asked what it sees: steps of a tenth of a degree."""
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


def surface_for(
    lens: Lens,
    kind: str = 'cylindrical',
    *,
    scale: str = 'preserve_area',
    hfov_rad: float = 0.0,
    vfov_rad: float = 0.0,
    width: int = 0,
    height: int = 0,
    attitude: Attitude = LEVEL,
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
    attitude
        Of the camera in the frame of the surface.

    Raises
    ------
    GeometryError
        Where the surface cannot hold what was asked.
    """
    if kind not in KINDS:
        raise GeometryError(
            f"surface '{kind}' is not known; expected one of {', '.join(SURFACES)}"
        )
    if scale not in SCALES:
        raise GeometryError(f"scale '{scale}' is not known; expected one of {', '.join(SCALES)}")
    how = KINDS[kind]
    if max(hfov_rad, vfov_rad) >= how.fov_limit_rad:
        raise GeometryError(
            f'a {kind} surface holds less than {np.degrees(how.fov_limit_rad):g} degrees; '
            f'{np.degrees(max(hfov_rad, vfov_rad)):g} were asked'
        )
    sees = lens.field_rad() if attitude == LEVEL else _field_seen(lens, attitude)
    left, right = _extent(hfov_rad, *sees[:2], how.widest_rad)
    up, down = _extent(vfov_rad, *sees[2:], how.steepest_rad)
    columns = how.column(left) + how.column(right)
    rows = how.row(up) + how.row(down)
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
        center_x_px=how.column(left) * focal_px - 0.5,
        center_y_px=how.row(up) / rows * height - 0.5,
    )


def _field_seen(lens: Lens, attitude: Attitude) -> tuple[float, float, float, float]:
    """How far a turned camera sees to the left, right, up and down of straight ahead, rad.

    Along the horizon, or where it does not see that, along the elevation of its axis.
    """
    elevations = np.linspace(-pi / 2, pi / 2, _SAMPLES)
    seen = elevations[_sees(lens, attitude, np.zeros(_SAMPLES), elevations)]
    if not len(seen):
        raise GeometryError(
            f'a camera with the attitude {attitude} sees nothing straight ahead; expected one '
            'whose picture reaches there (see pitch_deg, roll_deg)'
        )
    along = 0.0 if seen[0] <= 0 <= seen[-1] else attitude.pitch_rad
    sides = np.linspace(0.0, pi, _SAMPLES)
    unseen = [
        np.flatnonzero(~_sees(lens, attitude, sign * sides, np.full(_SAMPLES, along)))
        for sign in (-1, 1)
    ]
    left, right = (float(sides[max(0, at[0] - 1)]) if len(at) else pi for at in unseen)
    return left, right, float(seen[-1]), float(-seen[0])


def _sees(
    lens: Lens, attitude: Attitude, azimuths: np.ndarray, elevations: np.ndarray
) -> np.ndarray:
    """Whether a camera sees anything in directions of a level frame."""
    x, y, z = KINDS['equirectangular'].rays(azimuths, -elevations)
    pixels, seen = lens.project(np.stack([x, y, z], axis=-1) @ attitude.matrix)
    last = np.array([lens.width, lens.height]) - 0.5
    return seen & np.all((pixels >= -0.5) & (pixels <= last), axis=-1)


def _extent(
    asked_rad: float, before_rad: float, after_rad: float, limit_rad: float
) -> tuple[float, float]:
    """Angles to either side of the axis: half of what was asked, else what the lens sees."""
    if asked_rad:
        return asked_rad / 2, asked_rad / 2
    return min(before_rad, limit_rad), min(after_rad, limit_rad)
