"""Levelling: which way is down for a rig whose cameras are only known against each other."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product
from math import atan2, isnan, nan, pi

import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import LEVEL, Attitude, rotation_matrix
from fisheye_geometry.rig import unwrapped

LEVELS = ('symmetric', 'imu', 'first', 'none')
DOWN = np.array([0.0, 1.0, 0.0])
_QUARTERS_RAD = (0.0, pi, pi / 2, -pi / 2)
"""How cameras are turned about their axis if nobody says it, the usual first."""
_SURELY_LEFT_RAD = np.radians(-165)
"""A right camera whose axis is farther to the left lies behind the left one."""
_TILT_FOR_QUARTER_RAD = np.radians(12.0)
"""By how much less tilt has to follow from turned cameras than from upright ones: two on their
side and two that look down steeply may be turned against each other by the same rotation."""


@dataclass(frozen=True)
class Mount:
    """What is known of how a camera is mounted, rad; NaN: not known."""

    yaw_rad: float = nan
    pitch_rad: float = nan
    roll_rad: float = nan

    @property
    def is_known(self) -> bool:
        """Whether all three angles are given."""
        return not any(map(isnan, (self.yaw_rad, self.pitch_rad, self.roll_rad)))

    @property
    def attitude(self) -> Attitude:
        """The angles, with 0 for those that are not known."""
        angles = (self.yaw_rad, self.pitch_rad, self.roll_rad)
        return Attitude(*(0.0 if isnan(angle) else angle for angle in angles))


def levelled(
    attitudes: Sequence[np.ndarray],
    how: str = 'symmetric',
    *,
    mounts: Sequence[Mount] = (),
    gravity: np.ndarray | None = None,
    is_closed: bool = False,
    extra: Attitude = LEVEL,
) -> list[np.ndarray]:
    """Turn the attitudes of a rig so that they are those in a level frame.

    Parameters
    ----------
    attitudes
        Rotations (3, 3) of rays of each camera to rays of one common frame.
    how
        'symmetric': the outer cameras of an open rig, all of a closed one, pitch and roll alike;
        'first': the first camera is level; 'imu': by `gravity`; 'none': the frame is level as it
        is, or as the first camera's mount says.
    mounts
        What is known of each camera; () for nothing. A pitch and a roll that are known decide
        where 'symmetric' would guess, a roll alone says which way up a camera is.
    gravity
        Where things fall, (3,) of any length, in the common frame.
    is_closed
        Whether the last camera meets the first.
    extra
        Attitude of what is level now in the frame that is wanted.

    Returns
    -------
    list of ndarray
        Rotations (3, 3). Bearing 0 lies midway from the first axis to the last, unless the yaw
        of a mount says otherwise.

    Raises
    ------
    GeometryError
        For a `how` that is not known, and without gravity where it is needed.
    """
    attitudes = [np.asarray(attitude, float) for attitude in attitudes]
    mounts = tuple(mounts) or (Mount(),) * len(attitudes)
    if how not in LEVELS:
        raise GeometryError(f"level '{how}' is not known; expected one of {', '.join(LEVELS)}")
    if how == 'none':
        first = mounts[0].attitude.matrix if mounts[0].is_known else np.eye(3)
        level = [first @ attitudes[0].T @ attitude for attitude in attitudes]
        return [
            extra.matrix @ attitude for attitude in (level if mounts[0].is_known else attitudes)
        ]
    if how == 'first':
        down = attitudes[0] @ DOWN
    elif how == 'imu':
        if gravity is None or not np.linalg.norm(gravity) > 0:
            raise GeometryError(f'gravity is {gravity}; expected a vector (see level, imu)')
        down = np.asarray(gravity, float)
    else:
        down = _down(attitudes, mounts, is_closed)
    upright = _upright(down)
    level = [upright @ attitude for attitude in attitudes]
    ahead = rotation_matrix(-_ahead_rad(level, mounts) * DOWN)
    return [extra.matrix @ ahead @ attitude for attitude in level]


def level_turn(down: np.ndarray) -> np.ndarray:
    """Return the rotation (3, 3) that levels a frame in which a direction (3,) is down.

    What is ahead, z, keeps its bearing.
    """
    upright = _upright(down)
    x, _, z = upright[:, 2]
    return rotation_matrix(-atan2(x, z) * DOWN) @ upright


def _upright(down: np.ndarray) -> np.ndarray:
    """Return the smallest rotation (3, 3) that takes a direction (3,) to `DOWN`."""
    down = down / np.linalg.norm(down)
    axis = np.cross(down, DOWN)
    sine, cosine = np.linalg.norm(axis), float(down @ DOWN)
    if sine < 1e-12:
        return np.eye(3) if cosine > 0 else np.diag([-1.0, -1.0, 1.0])
    return rotation_matrix(axis / sine * atan2(sine, cosine))


def _ahead_rad(level: list[np.ndarray], mounts: Sequence[Mount]) -> float:
    """Return the bearing of a level frame that is to become 0."""
    bearings = unwrapped([Attitude.of(attitude).yaw_rad for attitude in level])
    known = [(b, m.yaw_rad) for b, m in zip(bearings, mounts, strict=True) if not isnan(m.yaw_rad)]
    if known:
        # The mean of angles that may lie on both sides of pi.
        turns = np.array([[np.sin(b - yaw), np.cos(b - yaw)] for b, yaw in known]).sum(axis=0)
        return atan2(*turns)
    return (bearings[0] + bearings[-1]) / 2


def _down(attitudes: list[np.ndarray], mounts: Sequence[Mount], is_closed: bool) -> np.ndarray:
    """Return the direction (3,) in the common frame that is most likely down."""
    told = [
        attitude @ mount.attitude.matrix.T @ DOWN
        for attitude, mount in zip(attitudes, mounts, strict=True)
        if not isnan(mount.pitch_rad) and not isnan(mount.roll_rad)
    ]
    if told:
        return np.sum(told, axis=0)
    axes = [attitude[:, 2] for attitude in attitudes]
    if not is_closed and len(attitudes) > 2:
        attitudes, mounts = [attitudes[0], attitudes[-1]], [mounts[0], mounts[-1]]
    best, best_tilt = attitudes[0] @ DOWN, np.inf
    for rolls in _rolls(mounts):
        upright = [a @ Attitude(roll_rad=-r).matrix for a, r in zip(attitudes, rolls, strict=True)]
        down, tilt = _alike(upright)
        is_guess = any(roll and isnan(m.roll_rad) for roll, m in zip(rolls, mounts, strict=True))
        tilt += _TILT_FOR_QUARTER_RAD if is_guess else 0.0
        if tilt < best_tilt and not _goes_left(axes, down):
            best, best_tilt = down, tilt
    return best


def _rolls(mounts: Sequence[Mount]) -> Iterable[tuple[float, ...]]:
    """How the cameras may be turned about their axes: as it is known, else upright first."""
    if len(mounts) == 2:
        return product(*(_QUARTERS_RAD if isnan(m.roll_rad) else (m.roll_rad,) for m in mounts))
    return [
        tuple(roll if isnan(mount.roll_rad) else mount.roll_rad for mount in mounts)
        for roll in (0.0, pi)
    ]


def _alike(attitudes: list[np.ndarray]) -> tuple[np.ndarray, float]:
    """Return the direction that all cameras see most alike and nearly as down, and their tilt."""
    if len(attitudes) == 1:
        return attitudes[0] @ DOWN, 0.0
    mean = np.mean([attitude.T for attitude in attitudes], axis=0)
    down = np.linalg.svd(mean)[2][0]
    if down @ mean.T @ DOWN < 0:
        down = -down
    seen = float(np.linalg.norm(np.cross(mean @ down, DOWN)))
    return down, atan2(seen, float(mean @ down @ DOWN))


def _goes_left(axes: list[np.ndarray], down: np.ndarray) -> bool:
    """Whether optical axes (3,) would follow each other to the left, were `down` down."""
    level = np.array(axes) @ _upright(down).T
    steps = np.diff(np.arctan2(level[:, 0], level[:, 2]))
    return bool(((steps - _SURELY_LEFT_RAD) % (2 * pi) + _SURELY_LEFT_RAD).sum() < 0)
