"""Attitudes: how a camera is turned, as angles that a person sets and as a rotation matrix.

Frames follow REP-103 for optical frames: z forward, x right, y down; a level frame has y straight
down. NumPy and `cv2.Rodrigues` are enough here: SciPy's `Rotation` would add 0.2 s to the start
of every node.
"""

from dataclasses import dataclass
from math import asin, atan2, cos, hypot, sin

import cv2
import numpy as np

_STRAIGHT_UP = 1 - 1e-12
"""Sine of the pitch from which on yaw and roll are one and the same turn."""

_ROUNDING_RAD = 1e-9


@dataclass(frozen=True)
class Attitude:
    """How a camera is turned in another frame, rad.

    Yaw turns it to the right, pitch up, roll clockwise as the camera sees it, in the order yaw,
    pitch, roll.
    """

    yaw_rad: float = 0.0
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    @classmethod
    def of(cls, matrix: np.ndarray) -> 'Attitude':
        """Return the angles of a rotation (3, 3) that takes rays of the camera to that frame."""
        matrix = np.asarray(matrix, float)
        up = float(-matrix[1, 2])
        if abs(up) > _STRAIGHT_UP:
            return cls(atan2(-matrix[2, 0], matrix[0, 0]), asin(max(-1.0, min(1.0, up))), 0.0)
        return cls(
            atan2(matrix[0, 2], matrix[2, 2]),
            atan2(up, hypot(matrix[0, 2], matrix[2, 2])),
            atan2(matrix[1, 0], matrix[1, 1]),
        )

    @property
    def matrix(self) -> np.ndarray:
        """Rotation (3, 3) that takes rays of the camera to rays of the frame it is turned in."""
        (cy, sy), (cp, sp), (cr, sr) = (
            (cos(angle), sin(angle)) for angle in (self.yaw_rad, self.pitch_rad, self.roll_rad)
        )
        yaw = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
        pitch = np.array([[1, 0, 0], [0, cp, -sp], [0, sp, cp]])
        roll = np.array([[cr, -sr, 0], [sr, cr, 0], [0, 0, 1]])
        return yaw @ pitch @ roll

    @property
    def is_pure_yaw(self) -> bool:
        """Whether the camera is level: turned about the vertical only."""
        return max(abs(self.pitch_rad), abs(self.roll_rad)) < _ROUNDING_RAD


LEVEL = Attitude()


def rotation_vector(matrix: np.ndarray) -> np.ndarray:
    """Return the axis of a rotation (3, 3) times its angle, (3,) rad."""
    return cv2.Rodrigues(np.asarray(matrix, float))[0].ravel()


def rotation_matrix(vector: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) about an axis (3,) whose length is the angle, rad."""
    return cv2.Rodrigues(np.asarray(vector, float))[0]


def quaternion(attitude: Attitude) -> tuple[float, float, float, float]:
    """Return the rotation of an attitude as the unit quaternion (x, y, z, w), w not negative."""
    vector = rotation_vector(attitude.matrix)
    angle_rad = float(np.linalg.norm(vector))
    scale = sin(angle_rad / 2) / angle_rad if angle_rad else 0.5
    x, y, z = (float(value) for value in scale * vector)
    return x, y, z, cos(angle_rad / 2)


def attitude_of(x: float, y: float, z: float, w: float) -> Attitude:
    """Return the attitude of a unit quaternion; the inverse of `quaternion`."""
    vector = np.array([x, y, z])
    sine = float(np.linalg.norm(vector))
    scale = 2 * atan2(sine, w) / sine if sine else 2.0
    return Attitude.of(rotation_matrix(scale * vector))


def angle_between(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle of the rotation that takes one attitude (3, 3) to another, rad."""
    return float(np.linalg.norm(rotation_vector(np.asarray(first).T @ np.asarray(second))))


def closest_rotation(first: np.ndarray, second: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) of the second rays that brings them nearest to the first ones.

    Kabsch, Acta Cryst. A32, 1976, doi 10.1107/S0567739476001873.

    Parameters
    ----------
    first, second
        (N, 3) unit vectors, pair by pair.
    weight
        (N,) of the pairs.
    """
    u, _, vt = np.linalg.svd((first * weight[:, None]).T @ second)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
