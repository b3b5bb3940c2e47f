"""A rig: named cameras that are fixed to each other, each with what it sees and its attitude.

All rays are of the rig's level frame: y straight down, z forward, x right. Pairs of neighbours
come from `pairs_of` alone; whatever is kept for each pair follows its order.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import degrees, pi
from typing import NamedTuple

import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude, rotation_matrix, rotation_vector
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface

MAX_CAMERAS = 8
CAMERA_NAME = re.compile(r'[A-Za-z]\w*(/[A-Za-z]\w*)*', re.ASCII)
"""It is a namespace."""
RINGS = ('auto', 'open', 'closed')
MAX_RESIDUE_RAD = np.radians(3.0)
"""Rotations that miss the way around by more do not belong to one ring."""
_MOST_TO_THE_LEFT_RAD = np.radians(150)
"""Neighbours stand from left to right; only a frame that is upside down reverses that."""


class Pair(NamedTuple):
    """Indices of two neighbouring cameras."""

    left: int
    right: int


def pairs_of(cameras: int, is_closed: bool = False) -> tuple[Pair, ...]:
    """Return the neighbours among cameras that stand from left to right, the closing pair last."""
    pairs = tuple(Pair(*pair) for pair in pairwise(range(cameras)))
    return (*pairs, Pair(cameras - 1, 0)) if is_closed and cameras > 1 else pairs


def pairs_for(cameras: int, entries: int) -> tuple[Pair, ...]:
    """Return the pairs that so many entries are for: as many as cameras if a ring is closed."""
    return pairs_of(cameras, entries == cameras)


@dataclass(frozen=True)
class RigCamera:
    """A camera of a rig.

    Attributes
    ----------
    name
        The camera's name.
    source
        What its pictures show: a lens's view, or a surface where they are corrected already.
    attitude
        Takes rays of the source to rays of the rig.
    """

    name: str
    source: Lens | Surface
    attitude: Attitude


@dataclass(frozen=True)
class Rig:
    """Cameras from left to right.

    Attributes
    ----------
    cameras
        1 to 8.
    is_closed
        Whether the last camera and the first are neighbours too.
    apart
        Indices of the pairs whose rotation is not known: their images stand side by side.

    Raises
    ------
    GeometryError
        For too many or no cameras, and for a name that stands twice.
    """

    cameras: tuple[RigCamera, ...]
    is_closed: bool = False
    apart: tuple[int, ...] = ()

    def __post_init__(self) -> None:
        names = [camera.name for camera in self.cameras]
        if not 1 <= len(names) <= MAX_CAMERAS:
            raise GeometryError(
                f'the rig has {len(names)} cameras; expected 1 to {MAX_CAMERAS} of them'
            )
        if len(set(names)) != len(names):
            raise GeometryError(f'the rig has the cameras {names}; expected different names')

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Neighbours, the closing pair last."""
        return pairs_of(len(self.cameras), self.is_closed)

    def attitudes(self, pair: Pair) -> tuple[Attitude, Attitude]:
        """Return the attitudes of the left and the right camera."""
        return self.cameras[pair.left].attitude, self.cameras[pair.right].attitude

    def relative(self, pair: Pair) -> Attitude:
        """Return the attitude of the right camera in the frame of the left one."""
        left, right = self.attitudes(pair)
        return Attitude.of(left.matrix.T @ right.matrix)

    def yaw_between(self, pair: Pair) -> float:
        """Return the angle between the axes about the level vertical, rad, to the right."""
        return bearing_rad(*self.attitudes(pair))


def unwrapped(yaws_rad: Sequence[float]) -> tuple[float, ...]:
    """Add whole turns to bearings, rad, so that each lies right of the one before.

    Only one that would be more than 210 degrees to the right is taken to lie to the left.
    """
    bearings = [float(yaws_rad[0])]
    for before, after in pairwise(yaws_rad):
        step = (after - before + _MOST_TO_THE_LEFT_RAD) % (2 * pi) - _MOST_TO_THE_LEFT_RAD
        bearings.append(bearings[-1] + float(step))
    return tuple(bearings)


def bearing_rad(left: Attitude, right: Attitude) -> float:
    """Return the angle from one axis to another about the level vertical, rad, as `unwrapped`."""
    return unwrapped([left.yaw_rad, right.yaw_rad])[1] - left.yaw_rad


@dataclass(frozen=True)
class Chain:
    """Attitudes that follow from the rotations between neighbours.

    Attributes
    ----------
    attitudes
        Rotations (3, 3), one a camera, of rays of the camera to rays of the first one.
    is_closed
        Whether the last camera and the first show a common scene, and all rotations fit.
    residue_rad
        By how much they miss the way around; 0 where the closing pair has no rotation.
    message
        One sentence about the ring; '' where there is nothing to say.
    """

    attitudes: tuple[np.ndarray, ...]
    is_closed: bool = False
    residue_rad: float = 0.0
    message: str = ''


def chain(
    rotations: Sequence[np.ndarray],
    closing: np.ndarray | None = None,
    *,
    ring: str = 'auto',
) -> Chain:
    """Find the attitudes of cameras from the rotations between neighbours.

    Rotations that come back to the first camera do so whether the cameras stand all around or
    just overlap in front: what they show decides (see `leads_around` where panoramas are made).

    Parameters
    ----------
    rotations
        For each neighbouring pair from left to right the rotation (3, 3) of rays of the right
        camera to rays of the left one; none for a single camera.
    closing
        The same from the last camera (left) to the first (right); None: they share no scene.
    ring
        One of `RINGS`: 'auto' closes where `closing` fits, 'closed' without `closing` too,
        'open' never.

    Returns
    -------
    Chain
        Where it is closed, the residue is spread: each pair is turned by an equal share of it.
        A residue above 3 degrees leaves the chain open.
    """
    attitudes = [np.eye(3)]
    for rotation in rotations:
        attitudes.append(attitudes[-1] @ np.asarray(rotation, float))
    if ring == 'open' or closing is None:
        return Chain(tuple(attitudes), ring == 'closed')
    excess = rotation_vector(attitudes[-1] @ np.asarray(closing, float))
    residue_rad = float(np.linalg.norm(excess))
    if residue_rad > MAX_RESIDUE_RAD:
        return Chain(
            tuple(attitudes),
            False,
            residue_rad,
            f'the ring is not closed: the rotations around it miss by {degrees(residue_rad):.1f} '
            f'degrees, more than {degrees(MAX_RESIDUE_RAD):g}; expected cameras in the order in '
            'which they stand and calibrations that fit (ring:=open if it is none)',
        )
    # A turn in the first camera's frame, growing along the chain, is an equal one for each pair.
    shares = np.arange(len(attitudes)) / len(attitudes)
    spread = [
        rotation_matrix(-share * excess) @ attitude
        for share, attitude in zip(shares, attitudes, strict=True)
    ]
    message = f'the ring is closed; it missed by {degrees(residue_rad):.2f} degrees'
    return Chain(tuple(spread), True, residue_rad, message)
