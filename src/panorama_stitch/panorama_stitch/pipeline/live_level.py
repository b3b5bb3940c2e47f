"""The level of a rig on a robot that moves: what an IMU says of each panorama.

The panorama itself is levelled by where things fall in the long run. What the robot does within
seconds is told beside it, as its orientation, so that nobody has to build a table for it.
"""

from collections.abc import Callable
from math import radians
from time import monotonic

import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.inertial import ImuReading
from fisheye_geometry.level import level_turn
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline.gravity import GravityHistory, angle_rad, towards
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings
from panorama_stitch.pipeline.rig_state import RigState

_LONG_RUN_S, _FIRST_S = 10.0, 1.0
"""Over so long a robot drives level, or on one slope; and what has to do at first."""
_TURNED_RAD, _PAUSE_S = radians(3.0), 5.0
"""A panorama is laid out anew where the slope has changed by so much, and not more often."""
_SILENT_S = 2.0
_APART_S = 0.5
_TOLD_S = 5.0


class LiveLevel:
    """Follows an IMU, and tells how each panorama is turned against the level.

    Attributes
    ----------
    rig : RigState
        Gets the gravity of the long run.
    """

    def __init__(self, rig: RigState, clock: Callable[[], float] = monotonic):
        """Start; `rig` gets the gravity of the long run, `clock` gives the time, s."""
        self.rig, self._clock = rig, clock
        self._history = GravityHistory(clock)
        self._long_run: np.ndarray | None = None
        self._felt_s: float | None = None
        self._used_s, self._age_s = -_PAUSE_S, 0.0
        self._levelled: Compositor | None = None
        self._from_robot = np.eye(3)

    def feel(self, reading: ImuReading) -> bool:
        """Add what an IMU says; return whether the rig's gravity is another one now."""
        now_s = self._clock()
        since_s = now_s - self._felt_s if self._felt_s is not None else 0.0
        self._felt_s = now_s
        down = self._history.feel(reading)
        if down is None:
            return False
        self._age_s += since_s
        # At first it is the mean of all that was felt.
        share = since_s / max(min(_LONG_RUN_S, self._age_s), 1e-9)
        former = down if self._long_run is None else self._long_run
        self._long_run = towards(former, down, min(share, 1.0))
        if self._age_s < _FIRST_S or not self._is_other(now_s):
            return False
        self.rig.gravity, self._used_s = self._long_run, now_s
        return True

    def _is_other(self, now_s: float) -> bool:
        """Whether the slope is another one than the panorama was laid out for."""
        gravity = self.rig.gravity
        if gravity is None or self._long_run is None:
            return True
        turned_rad = angle_rad(gravity, self._long_run)
        return turned_rad > _TURNED_RAD and now_s - self._used_s > _PAUSE_S

    def orientation(
        self, compositor: Compositor, stamp_ns: int, settings: PanoramaOutputSettings
    ) -> Attitude | None:
        """Return what takes rays of a panorama to level rays at a time.

        Parameters
        ----------
        compositor
            Of the panorama.
        stamp_ns
            When it was taken.
        settings
            In use.

        Returns
        -------
        Attitude or None
            None where the panorama is level as it is, as far as anybody knows.
        """
        if settings.level != 'imu' or not compositor.layout.surface.yaw_is_column_shift:
            return None
        down = self._history.at(stamp_ns)
        if down is None or any(view.shift_px[0] for view in compositor.views):
            return None
        if compositor is not self._levelled:
            overlaps = self.rig.effective_overlaps(settings)
            robot = self.rig.solve(overlaps, settings, level='symmetric').rig.cameras[0]
            drawn = compositor.views[0].attitude.matrix
            self._from_robot, self._levelled = drawn @ robot.attitude.matrix.T, compositor
        # What a user turns on top of the level is no fault of the level.
        extra = self.rig.extra(settings).matrix
        turn = level_turn(extra.T @ self._from_robot @ down)
        return Attitude.of(extra @ turn @ extra.T)

    def faults(self) -> list[str]:
        """Return what is wrong with the IMU, in sentences, for `level:=imu`."""
        if self._felt_s is None:
            return ['level is imu, but nothing came on the topic imu; level is symmetric so far']
        silent_s = self._clock() - self._felt_s
        if silent_s > _SILENT_S:
            return [f'nothing came on the topic imu for {silent_s:.0f} s; the last level is held']
        history = self._history
        if self._clock() - history.jumped_s < _TOLD_S:
            return [
                f'the imu jumped by {history.jump_deg:.0f} degrees from one message to the next; '
                'the level before was held'
            ]
        if abs(history.apart_s) > _APART_S:
            return [
                f'the stamps of the imu are {abs(history.apart_s):.3g} s '
                f'{"behind" if history.apart_s > 0 else "ahead of"} those of the pictures; '
                'expected the same clock: the level follows late'
            ]
        return []
