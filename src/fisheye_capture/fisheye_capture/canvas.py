"""Painting all around a viewer: polygons in space on an equirectangular picture.

Points are in metres in the frame of the viewer's eye: x right, y down, z towards bearing 0.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import cv2
import numpy as np

from fisheye_geometry.surface import Surface

_SUBPIXEL_BITS = 4
_STEPS = np.linspace(0, 1, 8, endpoint=False)[:, None]
"""Points along an edge, which is straight in space and a curve on the canvas."""


class Canvas:
    """An equirectangular picture of all directions, bearing 0 in the middle.

    Attributes
    ----------
    surface : Surface
        Where each direction lies.
    picture : ndarray
        (width // 2, width, 3) uint8 BGR.
    """

    def __init__(self, width: int):
        height = width // 2
        self.surface = Surface(
            'equirectangular', width, height, width / (2 * pi), (width - 1) / 2, (height - 1) / 2
        )
        self.picture = np.zeros((height, width, 3), np.uint8)

    def polygon(self, corners: np.ndarray, color: np.ndarray) -> None:
        """Fill a polygon (N, 3) that does not hold the nadir."""
        edges = np.roll(corners, -1, axis=0) - corners
        points = corners[:, None] + edges[:, None] * _STEPS
        pixels, _ = self.surface.project(points.reshape(-1, 3))
        self.outline(np.unwrap(pixels[:, 0], period=self.surface.width), pixels[:, 1], color)

    def rectangle(
        self, face: 'Face', u_m: float, v_m: float, width_m: float, height_m: float, color
    ) -> None:
        """Fill a rectangle on a face, (u, v) its lower left corner."""
        u, v = (u_m, u_m + width_m), (v_m, v_m + height_m)
        corners = np.array([(u[0], v[0]), (u[1], v[0]), (u[1], v[1]), (u[0], v[1])])
        self.polygon(face.at(corners), color)

    def outline(self, x_px: np.ndarray, y_px: np.ndarray, color: np.ndarray) -> None:
        """Fill an outline given in pixels, which may cross the left or the right edge."""
        width = self.surface.width
        for turn in (-width, 0, width):
            if (x_px + turn).max() > 0 and (x_px + turn).min() < width:
                points = np.stack([x_px + turn, y_px], axis=-1) * (1 << _SUBPIXEL_BITS)
                whole = np.rint(points).astype(np.int32)
                cv2.fillPoly(
                    self.picture, [whole], tuple(map(float, color)), cv2.LINE_AA, _SUBPIXEL_BITS
                )


def around(bearing_rad: float, distance_m: float, y_m: float = 0.0) -> np.ndarray:
    """Return the point at a bearing and a distance over ground, y below the eye."""
    return np.array([np.sin(bearing_rad) * distance_m, y_m, np.cos(bearing_rad) * distance_m])


@dataclass(frozen=True)
class Face:
    """An upright rectangle in space, seen from its front.

    Attributes
    ----------
    origin : ndarray
        (3,) its lower left corner.
    right : ndarray
        (3,) unit vector along its lower edge.
    width_m
        Its breadth.
    light
        How brightly it is lit, 1 at most.
    """

    origin: np.ndarray
    right: np.ndarray
    width_m: float
    light: float

    def at(self, points: np.ndarray) -> np.ndarray:
        """Map points (N, 2), m right of and above the lower left corner, to space (N, 3)."""
        u, v = points.T
        return self.origin + u[:, None] * self.right - v[:, None] * (0.0, 1.0, 0.0)


def faces_of_box(
    center: np.ndarray, turn_rad: float, width_m: float, depth_m: float
) -> Iterator[Face]:
    """Return the upright faces of a box that the viewer sees; `center` (3,) is on the ground."""
    for quarter in range(4):
        angle = turn_rad + quarter * pi / 2
        outward, right = around(angle + pi, 1.0), around(angle + pi / 2, 1.0)
        breadth, reach = (width_m, depth_m) if quarter % 2 == 0 else (depth_m, width_m)
        middle = center + outward * reach / 2
        if outward @ middle < 0:
            light = 0.75 + 0.25 * float(outward @ around(-1.0, 1.0))
            yield Face(middle - right * breadth / 2, right, breadth, light)
