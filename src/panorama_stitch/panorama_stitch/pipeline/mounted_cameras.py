"""Cameras whose mounts may be known, and the rig that they and rotations between them make."""

from collections.abc import Sequence
from math import isnan, radians
from typing import Any

import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.level import Mount
from fisheye_geometry.rig import Pair
from fisheye_geometry.rig_solution import RigSolution, solve_rig
from panorama_stitch.overlap.overlap_result import Overlap, aligned_at
from panorama_stitch.pipeline.known_cameras import KnownCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

_MOUNT_RAD, _YAW_MOUNT_RAD = radians(20.0), radians(60.0)
"""How far a rotation may be from what mounts say: all three angles of both, or their yaw only."""


class MountedCameras(KnownCameras):
    """What each camera shows and how it is mounted, as far as that is known.

    Attributes
    ----------
    gravity
        Where things fall in the frame of the robot, (3,) with x right, y down, z ahead; None
        while that is not known.
    """

    def __init__(
        self,
        cameras: Sequence[str],
        mounts: Sequence[Mount] = (),
        mask_files: Sequence[str] = (),
    ):
        """Start with what is known before anything is seen.

        Parameters
        ----------
        cameras
            Names from left to right.
        mounts
            What is known of how each is mounted; () for nothing.
        mask_files
            Of each the image that is white where it sees the robot itself; '' for none, () for
            none of them.
        """
        super().__init__(cameras, mask_files)
        self.gravity: np.ndarray | None = None
        self._mounts = tuple(mounts) or (Mount(),) * len(self.cameras)

    def expected(self, pair: Pair) -> tuple[Attitude, float] | None:
        """Return what the mounts say of a pair: its rotation, and how far off it may be, rad."""
        left, right = self._mounts[pair.left], self._mounts[pair.right]
        if left.is_known and right.is_known:
            return Attitude.of(left.attitude.matrix.T @ right.attitude.matrix), _MOUNT_RAD
        if isnan(left.yaw_rad) or isnan(right.yaw_rad):
            return None
        return Attitude(yaw_rad=right.yaw_rad - left.yaw_rad), _YAW_MOUNT_RAD

    def solution(
        self, overlaps: Sequence[Overlap], settings: PanoramaOutputSettings
    ) -> RigSolution:
        """Return the rig that overlaps, mounts and level make; see `solve_rig`."""
        how, gravity = settings.level, None
        if how == 'imu' and self.gravity is None:
            how = 'symmetric'
        elif how == 'imu':
            # What the imu feels is in the robot's frame, in which the mounts are symmetric.
            robot = self.solve(overlaps, settings, level='symmetric').rig
            gravity = robot.cameras[0].attitude.matrix.T @ self.gravity
        extra = self.extra(settings)
        return self.solve(overlaps, settings, level=how, gravity=gravity, extra=extra)

    @staticmethod
    def extra(settings: PanoramaOutputSettings) -> Attitude:
        """Return what the settings turn on top of what is level."""
        return Attitude(
            *(radians(getattr(settings, f'level_{name}_deg')) for name in ('yaw', 'pitch', 'roll'))
        )

    def solve(
        self, overlaps: Sequence[Overlap], settings: PanoramaOutputSettings, **level: Any
    ) -> RigSolution:
        """Return the rig of overlaps with a level of its own: arguments of `solve_rig`."""
        count = len(self.cameras)
        rotations = [_rotation(overlap, settings) for overlap in overlaps]
        return solve_rig(
            [(name, self.places[i].source) for i, name in enumerate(self.cameras)],
            rotations[: count - 1],
            closing=rotations[count - 1] if len(rotations) == count else None,
            mounts=self._mounts,
            ring=settings.ring,
            **level,
        )


def _rotation(overlap: Overlap, settings: PanoramaOutputSettings) -> np.ndarray | None:
    """Return the rotation (3, 3) of right rays to left ones to be drawn with; None if unknown."""
    if not overlap.found or overlap.attitude is None:
        return None
    matrix, distance_m = overlap.attitude.matrix, settings.align_distance_m
    if not (settings.baseline_m and distance_m):
        return matrix
    return aligned_at(matrix, distance_m, settings.baseline_m)
