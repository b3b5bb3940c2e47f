"""A first estimate of a turn: each camera's focal length and axis, and the angle of each frame."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from fisheye_core.errors import CalibrationError
from fisheye_geometry.attitude import Attitude, closest_rotation, rotation_vector
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import intrinsics_of
from panorama_stitch.turn.expectation import NEARNESS
from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import TurnState, in_world

_FOCALS = 0.45, 4.0
"""Shares of width / pi between which focal lengths lie: from a circle to a narrow lens."""
_TOLERANCE = 0.003
_ROUNDS = 4

Step = tuple[np.ndarray, np.ndarray]
"""Pixels (n, 2) of the same corners in one frame and another."""


@dataclass(frozen=True)
class FirstCamera:
    """A camera without distortion whose axis is in the middle of the picture.

    Attributes
    ----------
    lens
        With it, the steps of a full turn make 360 degrees.
    turns
        (T - 1, 3) rotation vectors in its own frame, from each frame to the next, rad.
    """

    lens: FisheyeLens
    turns: np.ndarray

    @property
    def axis(self) -> np.ndarray:
        """Axis (3,) about which it turns to the right."""
        total = self.turns.sum(axis=0)
        return total / np.linalg.norm(total)


def first_camera(
    steps: Sequence[Step], closing: Step, last: int, size: tuple[int, int], name: str
) -> FirstCamera:
    """Find the lens with which a full turn is one.

    Parameters
    ----------
    steps
        From each frame to the next one.
    closing
        From frame `last` to the first.
    last
        The frame that is like the first one.
    size
        Width and height of the pictures, px.
    name
        Of the camera, for the sentence.

    Raises
    ------
    CalibrationError
        If there is none.
    """
    around = [*steps[:last], closing]

    def excess(log_share: float) -> float:
        lens = _lens(size, log_share)
        total = np.sum([_rotation(lens, *step) for step in around], axis=0)
        return float(np.linalg.norm(total)) - 2 * np.pi

    limits = np.log(_FOCALS)
    most, least = (excess(limit) for limit in limits)
    if not least < 0 < most:
        raise CalibrationError(
            f'what {name} shows moved around by {np.degrees(least) + 360:.0f} to '
            f'{np.degrees(most) + 360:.0f} degrees, depending on the lens; expected a full turn '
            'on the spot'
        )
    lens = _lens(size, brentq(excess, *limits, xtol=_TOLERANCE))
    return FirstCamera(lens, np.array([_rotation(lens, *step) for step in steps]))


def first_state(
    cameras: Sequence[FirstCamera],
    seen: Sightings,
    turns_right: bool | None,
    focal_share: float = 1.0,
) -> TurnState:
    """Put cameras together that turn as one, and the landmarks where they see them.

    Parameters
    ----------
    cameras
        Of the rig; each looks to where the rig does, as far as is known yet.
    seen
        What they saw.
    turns_right
        Which way the rig turned; None: the way in which most cameras are upright.
    focal_share
        Of the focal lengths: cameras that stand ahead of the axis make them look longer.
    """
    upright_share = sum(camera.axis[1] for camera in cameras)
    is_right = upright_share > 0 if turns_right is None else turns_right
    downs = [camera.axis if is_right else -camera.axis for camera in cameras]
    steps = [camera.turns @ down for camera, down in zip(cameras, downs, strict=True)]
    angles = np.concatenate([[0.0], np.cumsum(np.mean(steps, axis=0))])
    lenses = [_scaled(camera.lens, focal_share) for camera in cameras]
    attitudes = np.array([_upright(down) for down in downs])
    return TurnState(
        np.array([intrinsics_of(lens) for lens in lenses]),
        attitudes,
        np.zeros((len(cameras), 3)),
        angles,
        _directions(lenses, attitudes, angles, seen),
        np.full(seen.landmark.max() + 1, NEARNESS),
    )


def _directions(lenses, attitudes, angles, seen):
    """Mean directions (L, 3) in which landmarks were seen."""
    rays = np.empty((len(seen), 3))
    for camera, (lens, attitude) in enumerate(zip(lenses, attitudes, strict=True)):
        mine = seen.camera == camera
        rays[mine] = lens.unproject(seen.pixels[mine])[0] @ attitude.T
    total = np.zeros((seen.landmark.max() + 1, 3))
    np.add.at(total, seen.landmark, in_world(rays, angles[seen.frame]))
    return total / np.linalg.norm(total, axis=1, keepdims=True)


def _upright(down: np.ndarray) -> np.ndarray:
    """Return the attitude (3, 3), yaw 0, of a camera that sees `down` (3,) in its own frame."""
    x, y, z = down
    # Down in the camera's frame is the middle row of its attitude.
    return Attitude(0.0, float(np.arcsin(np.clip(-z, -1, 1))), float(np.arctan2(x, y))).matrix


def _lens(size: tuple[int, int], log_share: float) -> FisheyeLens:
    width, height = size
    focal = float(np.exp(log_share)) * width / np.pi
    return FisheyeLens(*size, focal, focal, (width - 1) / 2, (height - 1) / 2, (0.0,) * 4)


def _scaled(lens: FisheyeLens, share: float) -> FisheyeLens:
    return replace(lens, focal_x_px=lens.focal_x_px * share, focal_y_px=lens.focal_y_px * share)


def _rotation(lens: FisheyeLens, before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Return the rotation vector of the camera, in its own frame, that most corners agree on.

    Their weights fall with the distance from it.
    """
    first, second = lens.unproject(before)[0], lens.unproject(after)[0]
    weight, rotation = np.ones(len(first)), np.eye(3)
    for _ in range(_ROUNDS):
        rotation = closest_rotation(first, second, weight)
        miss = np.linalg.norm(first - second @ rotation.T, axis=1)
        weight = 1 / (1 + (miss / max(float(np.median(miss)), 1e-6)) ** 2) ** 2
    return rotation_vector(rotation)
