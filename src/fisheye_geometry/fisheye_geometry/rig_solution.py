"""Solving a rig: from what was measured and what is known of the mounts to attitudes that fit."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.level import Mount, levelled
from fisheye_geometry.rig import Rig, RigCamera, chain, pairs_of
from fisheye_geometry.surface import Surface


@dataclass(frozen=True)
class RigSolution:
    """A rig, and what a user should know of how it came about.

    Attributes
    ----------
    rig
        In its level frame.
    residue_rad
        By how much the rotations missed the way around a ring.
    messages
        Sentences.
    faults
        Those of the messages that tell what is wrong; that a ring is closed is well.
    """

    rig: Rig
    residue_rad: float
    messages: tuple[str, ...]
    faults: tuple[str, ...]


def solve_rig(
    cameras: Sequence[tuple[str, Lens | Surface]],
    rotations: Sequence[np.ndarray | None],
    *,
    closing: np.ndarray | None = None,
    mounts: Sequence[Mount] = (),
    ring: str = 'auto',
    level: str = 'symmetric',
    gravity: np.ndarray | None = None,
    extra: Attitude = LEVEL,
) -> RigSolution:
    """Find the attitudes of a rig's cameras in its level frame.

    Parameters
    ----------
    cameras
        Name and what the pictures show, from left to right.
    rotations
        For each neighbouring pair the rotation (3, 3) of rays of the right camera to rays of the
        left one; None where none was found: what is known of both mounts stands in, and where
        that is not enough the two are apart.
    closing
        The same from the last camera to the first.
    mounts
        What is known of each camera's attitude; () for nothing.
    ring
        One of `fisheye_geometry.rig.RINGS`.
    level, gravity, extra
        As `how`, `gravity` and `extra` of `fisheye_geometry.level.levelled`; gravity is in the
        frame of the first camera.

    Raises
    ------
    GeometryError
        For impossible rigs, and where gravity is missing.
    """
    names = [name for name, _ in cameras]
    mounts = tuple(mounts) or (Mount(),) * len(cameras)
    if len(rotations) != len(cameras) - 1 or len(mounts) != len(cameras):
        raise GeometryError(
            f'{len(rotations)} rotations and {len(mounts)} mounts for {len(cameras)} cameras; '
            'expected a rotation for each pair of neighbours and a mount for each camera'
        )
    known, apart, messages = [], [], []
    for index, (pair, rotation) in enumerate(zip(pairs_of(len(cameras)), rotations, strict=True)):
        left, right = (mounts[camera] for camera in pair)
        if rotation is None and left.is_known and right.is_known:
            rotation = left.attitude.matrix.T @ right.attitude.matrix
            messages.append(
                f'no overlap of {names[pair.left]} and {names[pair.right]} was found; they are '
                'drawn as yaw_deg, pitch_deg and roll_deg say'
            )
        elif rotation is None:
            rotation = np.eye(3)
            apart.append(index)
        known.append(rotation)
    found = chain(known, None if apart else closing, ring='open' if apart else ring)
    faults = messages if found.is_closed or not found.message else [*messages, found.message]
    messages = [*messages, found.message] if found.message else messages
    attitudes = levelled(
        found.attitudes,
        'none' if apart else level,
        mounts=mounts,
        gravity=gravity,
        is_closed=found.is_closed,
        extra=extra,
    )
    rig = Rig(
        tuple(
            RigCamera(name, source, Attitude.of(attitude))
            for (name, source), attitude in zip(cameras, attitudes, strict=True)
        ),
        found.is_closed,
        tuple(apart),
    )
    return RigSolution(rig, found.residue_rad, tuple(messages), tuple(faults))
