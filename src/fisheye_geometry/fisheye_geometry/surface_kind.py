"""The kinds of projection surfaces: a new one is a class here and an entry of `KINDS`.

`a` and `b` are columns and rows from the centre, in focal lengths.
"""

from abc import ABC, abstractmethod
from math import inf, pi

import numpy as np

Rays = tuple[np.ndarray, np.ndarray, np.ndarray]
Points = tuple[np.ndarray, np.ndarray]


class SurfaceKind(ABC):
    """How one kind of surface maps rays of the frame x right, y down, z forward.

    Attributes
    ----------
    yaw_is_column_shift
        Whether a turn about the vertical is exactly a shift of columns, so that a panorama on
        it can lead all around.
    steepest_rad
        No row is placed farther above or below the horizon unless it is asked for.
    widest_rad
        No column is placed farther to the side unless it is asked for.
    fov_limit_rad
        A field of view of so much or more cannot be asked for.
    """

    yaw_is_column_shift: bool
    steepest_rad: float
    widest_rad: float
    fov_limit_rad: float = inf

    def __init_subclass__(cls) -> None:
        needed = ('yaw_is_column_shift', 'steepest_rad', 'widest_rad')
        if missing := [name for name in needed if not hasattr(cls, name)]:
            raise TypeError(f'{cls.__name__} lacks {", ".join(missing)}')

    @abstractmethod
    def rays(self, a: np.ndarray, b: np.ndarray) -> Rays:
        """Return the rays (x, y, z), of any length, at columns and rows."""

    @abstractmethod
    def point(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Points:
        """Return the columns and rows of rays, infinite for those that do not meet the surface."""

    @abstractmethod
    def column(self, angle_rad: float) -> float:
        """Return the column, on the horizon, at an angle to the side."""

    @abstractmethod
    def row(self, angle_rad: float) -> float:
        """Return the row, straight ahead, at an angle below the horizon."""


class Cylindrical(SurfaceKind):
    """A cylinder about the vertical: uprights stay straight."""

    yaw_is_column_shift = True
    steepest_rad = np.radians(70)
    widest_rad = pi

    def rays(self, a: np.ndarray, b: np.ndarray) -> Rays:
        """As `SurfaceKind`."""
        return np.sin(a), b, np.cos(a)

    def point(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Points:
        """As `SurfaceKind`."""
        side = np.hypot(x, z)
        return np.arctan2(x, z), np.divide(y, side, out=np.full_like(y, np.inf), where=side > 0)

    def column(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(angle_rad)

    def row(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(np.tan(angle_rad))


class Equirectangular(SurfaceKind):
    """A sphere with meridians and parallels as columns and rows; what GPano viewers expect."""

    yaw_is_column_shift = True
    steepest_rad = pi / 2
    widest_rad = pi

    def rays(self, a: np.ndarray, b: np.ndarray) -> Rays:
        """As `SurfaceKind`."""
        return np.cos(b) * np.sin(a), np.sin(b), np.cos(b) * np.cos(a)

    def point(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Points:
        """As `SurfaceKind`."""
        return np.arctan2(x, z), np.arctan2(y, np.hypot(x, z))

    def column(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(angle_rad)

    def row(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(angle_rad)


class Rectilinear(SurfaceKind):
    """A plane: straight lines stay straight, and no more than half a sphere fits on it."""

    yaw_is_column_shift = False
    steepest_rad = np.radians(60)
    widest_rad = np.radians(60)
    fov_limit_rad = np.radians(170)

    def rays(self, a: np.ndarray, b: np.ndarray) -> Rays:
        """As `SurfaceKind`."""
        return a, b, np.ones_like(a)

    def point(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> Points:
        """As `SurfaceKind`."""
        front = z > 0
        a, b = (np.divide(c, z, out=np.full_like(c, np.inf), where=front) for c in (x, y))
        return a, b

    def column(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(np.tan(angle_rad))

    def row(self, angle_rad: float) -> float:
        """As `SurfaceKind`."""
        return float(np.tan(angle_rad))


KINDS: dict[str, SurfaceKind] = {
    'cylindrical': Cylindrical(),
    'equirectangular': Equirectangular(),
    'rectilinear': Rectilinear(),
}
