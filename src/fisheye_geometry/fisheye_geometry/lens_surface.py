"""The surface for a lens: kind, size and focal length that hold what a camera sees."""

from math import pi

import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import on_picture
from fisheye_geometry.surface import SURFACES, Surface
from fisheye_geometry.surface_kind import KINDS

SCALES = ('preserve_area', 'fit')
_SAMPLES = 3601
"""Directions in which a turned camera is asked what it sees: steps of a tenth of a degree."""


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
    return on_picture(lens, np.stack([x, y, z], axis=-1) @ attitude.matrix)[1]


def _extent(
    asked_rad: float, before_rad: float, after_rad: float, limit_rad: float
) -> tuple[float, float]:
    """Angles to either side of the axis: half of what was asked, else what the lens sees."""
    if asked_rad:
        return asked_rad / 2, asked_rad / 2
    return min(before_rad, limit_rad), min(after_rad, limit_rad)
