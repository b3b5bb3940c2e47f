"""Gravity as a robot that moves feels it: at the time of each picture, and in the long run."""

from collections import deque
from collections.abc import Callable
from math import degrees, exp, inf, radians
from threading import Lock
from time import monotonic
from typing import NamedTuple

import numpy as np

from fisheye_geometry.attitude import rotation_matrix
from fisheye_geometry.inertial import ImuReading

_KEPT = 4000
"""Readings: some seconds."""
_TRUST_TURN_S, _TRUST_NOTHING_S = 2.0, 0.2
"""How long the level follows the measured turns before it follows the acceleration; and how long
accelerations are averaged where no turns are measured."""
_USUAL_SHARE, _UNUSUAL = 0.01, 0.15
"""An acceleration that is longer or shorter by more than that share is no gravity alone."""
_START_S = 0.5
"""So long it is not known what is usual."""
_GAP_S = 0.5
"""After a longer silence nothing is known of the turns meanwhile."""
_JUMP_RAD, _FASTEST_RAD_S = radians(5.0), radians(700.0)
"""No rig turns faster: farther, and it is the IMU that jumped."""
_BELIEVED_S = 0.3
"""What an IMU says for so long after a jump is taken for true."""
_AHEAD_S = 0.05
"""Pictures that are newer than the last reading are levelled by its turn, so far."""


class _Moment(NamedTuple):
    stamp_ns: int
    down: np.ndarray
    turn_rad_s: np.ndarray


class GravityHistory:
    """Where things fall in the robot's frame, over the last seconds; from any thread.

    Where the IMU gives an orientation that is taken. Otherwise the direction of the acceleration
    is, over a few seconds, and the turns that the IMU measures within them: a complementary filter
    (R. Mahony et al., "Nonlinear complementary filters on the special orthogonal group", 2008,
    https://doi.org/10.1109/TAC.2008.923738).

    Attributes
    ----------
    jump_deg : float
        By how much the IMU jumped from one message to the next, the last time.
    jumped_s : float
        When that was, s of the clock.
    apart_s : float
        How much later than the last reading the last picture was taken.
    """

    def __init__(self, clock: Callable[[], float] = monotonic):
        """Start; `clock` gives the time, s."""
        self._clock = clock
        self.jump_deg = self.apart_s = 0.0
        self.jumped_s = -inf
        self._moments: deque[_Moment] = deque(maxlen=_KEPT)
        self._newest_ns = 0
        self._doubted_ns: int | None = None
        self._age_s = self._usual = 0.0
        self._lock = Lock()

    def feel(self, reading: ImuReading) -> np.ndarray | None:
        """Add a reading; return where things fall now, (3,), None where nothing was learnt."""
        with self._lock:
            last = self._moments[-1] if self._moments else None
            since_s = (reading.stamp_ns - last.stamp_ns) * 1e-9 if last else 0.0
            if last and -_GAP_S < since_s <= 0:
                return None  # late, or told twice
            if last is None or not 0 < since_s < _GAP_S:
                self._moments.clear()
                self._newest_ns, self._doubted_ns = reading.stamp_ns, None
                self._age_s = self._usual = 0.0
                return self._keep(reading, reading.down, last=None)
            expected = last.down
            if reading.turn_rad_s is not None:
                mean_rad_s = (last.turn_rad_s + reading.turn_rad_s) / 2
                expected = _turned(last.down, mean_rad_s, since_s)
            if self._is_doubted(reading, expected):
                return None
            if reading.is_fused:
                return self._keep(reading, reading.down, last)
            return self._keep(reading, self._blended(reading, expected, since_s), last)

    def at(self, stamp_ns: int) -> np.ndarray | None:
        """Return where things fell at a time, (3,); None before anything was felt."""
        with self._lock:
            if not self._moments:
                return None
            self.apart_s = (stamp_ns - self._moments[-1].stamp_ns) * 1e-9
            later: _Moment | None = None
            for moment in reversed(self._moments):
                if moment.stamp_ns <= stamp_ns:
                    return _between(moment, later, stamp_ns)
                later = moment
            return self._moments[0].down

    def _keep(self, reading: ImuReading, down: np.ndarray, last: _Moment | None) -> np.ndarray:
        turn_rad_s = reading.turn_rad_s
        if turn_rad_s is None:
            turn_rad_s = np.zeros(3)
            if last:
                since_s = (reading.stamp_ns - last.stamp_ns) * 1e-9
                turn_rad_s = np.cross(down, last.down) / since_s
        self._moments.append(_Moment(reading.stamp_ns, down, turn_rad_s))
        return down

    def _is_doubted(self, reading: ImuReading, expected: np.ndarray) -> bool:
        """Whether an orientation cannot be true: it is farther off than a rig can turn."""
        since_s = (reading.stamp_ns - self._newest_ns) * 1e-9
        self._newest_ns = reading.stamp_ns
        off_rad = angle_rad(expected, reading.down)
        if not reading.is_fused or off_rad <= _JUMP_RAD + _FASTEST_RAD_S * max(since_s, 0.0):
            self._doubted_ns = None
            return False
        if self._doubted_ns is None:
            self._doubted_ns = reading.stamp_ns
            self.jump_deg, self.jumped_s = degrees(off_rad), self._clock()
        if (reading.stamp_ns - self._doubted_ns) * 1e-9 < _BELIEVED_S:
            return True
        self._doubted_ns = None
        return False

    def _blended(self, reading: ImuReading, expected: np.ndarray, since_s: float) -> np.ndarray:
        """Follow the turn, and slowly what an acceleration that can be gravity says."""
        self._age_s += since_s
        usual = self._usual or reading.acceleration
        share = max(_USUAL_SHARE, since_s / self._age_s)
        self._usual = usual + share * (reading.acceleration - usual)
        is_odd = abs(reading.acceleration - usual) > _UNUSUAL * usual
        if is_odd and self._age_s > _START_S:
            return expected
        trust_s = _TRUST_NOTHING_S if reading.turn_rad_s is None else _TRUST_TURN_S
        # At first it is the mean of all that was felt.
        trust_s = min(trust_s, self._age_s)
        return towards(expected, reading.down, 1 - exp(-since_s / trust_s))


def _turned(down: np.ndarray, turn_rad_s: np.ndarray, seconds: float) -> np.ndarray:
    """Return where a direction of the world lies after a turn of the robot."""
    return rotation_matrix(-seconds * turn_rad_s) @ down


def _between(moment: _Moment, later: _Moment | None, stamp_ns: int) -> np.ndarray:
    after_s = (stamp_ns - moment.stamp_ns) * 1e-9
    if later is None:
        return _turned(moment.down, moment.turn_rad_s, min(after_s, _AHEAD_S))
    share = (stamp_ns - moment.stamp_ns) / (later.stamp_ns - moment.stamp_ns)
    return towards(moment.down, later.down, share)


def towards(first: np.ndarray, second: np.ndarray, share: float) -> np.ndarray:
    """Return the direction (3,) that lies a share of the way from one to another."""
    between = first + share * (second - first)
    return between / max(float(np.linalg.norm(between)), 1e-9)


def angle_rad(first: np.ndarray, second: np.ndarray) -> float:
    """Return the angle between two directions (3,), rad."""
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
