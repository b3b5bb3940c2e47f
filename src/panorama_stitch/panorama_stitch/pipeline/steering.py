"""Steering: a view that turns smoothly to where it is told to look, within what the rig sees."""

from dataclasses import replace
from math import atan, atan2, cos, exp, hypot, isfinite, pi, radians, sin, tan

from fisheye_core.errors import SettingError
from panorama_stitch.compose.layout import Layout
from panorama_stitch.compose.virtual_camera import VirtualCamera

_SETTLE_S = 0.12
"""Time in which all but a third of the way is gone."""
_FASTEST_RAD_S = radians(240.0)
_ARRIVED_RAD = radians(0.02)
_LONGEST_STEP_S = 0.2
"""After a pause a view goes on from where it was."""
NARROWEST_RAD, WIDEST_RAD = radians(1.0), radians(170.0)


class Steering:
    """Where a steered view looks, from picture to picture."""

    def __init__(self, camera: VirtualCamera):
        """Start from where the view looks by itself."""
        self._now = self._wanted = camera
        self._stamp_ns: int | None = None

    def look(self, yaw_rad: float, pitch_rad: float, hfov_rad: float) -> None:
        """Turn to a direction; a field of view of 0 leaves it as it is.

        Raises
        ------
        SettingError
            For what is not a number, and for fields of view that there are not.
        """
        for name, value in (('x', yaw_rad), ('y', pitch_rad), ('z', hfov_rad)):
            if not isfinite(value):
                raise SettingError(f'{name} of look is {value}; expected a finite number of rad')
        if hfov_rad and not NARROWEST_RAD <= hfov_rad <= WIDEST_RAD:
            raise SettingError(
                f'z of look, the field of view, is {hfov_rad:g}; expected 0 or '
                f'{NARROWEST_RAD:.4f} to {WIDEST_RAD:.4f} rad'
            )
        self._wanted = replace(
            self._wanted,
            yaw_rad=_around(yaw_rad),
            pitch_rad=max(-pi / 2, min(pi / 2, pitch_rad)),
            hfov_rad=hfov_rad or self._wanted.hfov_rad,
        )

    def at(self, stamp_ns: int, layout: Layout) -> VirtualCamera:
        """Return where the view looks at the time of a picture of a panorama."""
        aim = limited(self._wanted, layout)
        since_s = (stamp_ns - self._stamp_ns) * 1e-9 if self._stamp_ns is not None else 0.0
        self._stamp_ns = stamp_ns
        since_s = max(0.0, min(since_s, _LONGEST_STEP_S))
        if layout.wraps:
            yaw_rad = _around(aim.yaw_rad - self._now.yaw_rad)
        else:
            yaw_rad = _in_panorama(aim, layout) - _in_panorama(self._now, layout)
        way = (
            yaw_rad,
            aim.pitch_rad - self._now.pitch_rad,
            aim.hfov_rad - self._now.hfov_rad,
        )
        length_rad = hypot(*way)
        if length_rad < _ARRIVED_RAD:
            self._now = aim
            return aim
        step_rad = min((1 - exp(-since_s / _SETTLE_S)) * length_rad, _FASTEST_RAD_S * since_s)
        yaw, pitch, hfov = (each * step_rad / length_rad for each in way)
        self._now = replace(
            aim,
            yaw_rad=_around(self._now.yaw_rad + yaw),
            pitch_rad=self._now.pitch_rad + pitch,
            hfov_rad=self._now.hfov_rad + hfov,
        )
        return self._now


def limited(camera: VirtualCamera, layout: Layout) -> VirtualCamera:
    """Turn and narrow a camera until it shows what the panorama does and no more."""
    surface = layout.surface
    x = surface.center_x_px
    rays = surface.rays(x, [-0.5, surface.height - 0.5])
    top, bottom = (-atan2(ray[1], hypot(ray[0], ray[2])) for ray in rays)
    hfov_rad = camera.hfov_rad
    left, right = ((edge - x) / surface.focal_px for edge in (-0.5, surface.width - 0.5))
    if not layout.wraps:
        hfov_rad = min(hfov_rad, right - left)
    tall = tan(hfov_rad / 2) * camera.height / camera.width
    pitch_rad = _between(camera.pitch_rad, bottom + atan(tall), top - atan(tall))
    yaw_rad = camera.yaw_rad
    if not layout.wraps:
        yaw_rad = _in_panorama(camera, layout)
        # The corners that are nearer to the zenith or nadir reach farther to the sides.
        ahead = cos(pitch_rad) - tall * sin(abs(pitch_rad))
        side_rad = atan2(tan(hfov_rad / 2), ahead)
        yaw_rad = _around(_between(yaw_rad, left + side_rad, right - side_rad))
    return replace(camera, yaw_rad=yaw_rad, pitch_rad=pitch_rad, hfov_rad=hfov_rad)


def _in_panorama(camera: VirtualCamera, layout: Layout) -> float:
    """Return a camera's yaw as the panorama counts it: at most half around from its middle."""
    surface = layout.surface
    middle_rad = ((surface.width - 1) / 2 - surface.center_x_px) / surface.focal_px
    return middle_rad + _around(camera.yaw_rad - middle_rad)


def _between(value: float, low: float, high: float) -> float:
    """Return the nearest value between two; the middle where there is none."""
    return (low + high) / 2 if low > high else max(low, min(high, value))


def _around(angle_rad: float) -> float:
    """Return the same direction as an angle from -pi up to pi."""
    return (angle_rad + pi) % (2 * pi) - pi
