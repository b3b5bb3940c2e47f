"""How certain a calibration from a turn is, and what speaks against using it."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from fisheye_geometry.attitude import angle_between
from panorama_stitch.turn.lens_angles import LensAngles, with_common
from panorama_stitch.turn.turn_calibration import TurnCalibration
from panorama_stitch.turn.turn_state import OF_CAMERA, WIDTH

SIGMAS = 2.0
_MAX_ANGLE_DEG = 0.3
_MAX_FOCAL = 0.005
_MAX_ROTATION_DEG = 0.3
_MAX_NOISE_WIDTHS = 1 / 800
_MIN_REACH = 0.85
"""Share of the angle at the picture's edge up to which landmarks must have been seen."""
_MIN_FOUND = 0.4
_MAX_OFF_AXIS = 0.1
"""Of the usual distance: beyond it near things look too different from place to place."""
_ON_AXIS = 0.02
"""Of the usual distance: below it things at different distances do not move against each other."""
_MIN_SHARED = 100
"""Landmarks that a camera must have in common with others."""
_TURNS = [OF_CAMERA.index(f'turn_{axis}') for axis in 'xyz']


@dataclass(frozen=True)
class TurnCertainty:
    """How far off what a turn tells may be, and what speaks against using it."""

    calibration: TurnCalibration

    @cached_property
    def lenses(self) -> tuple[LensAngles, ...]:
        """How far off each camera's lens may be."""
        calibration = self.calibration
        fit, halves = calibration.fit, calibration.halves
        return tuple(
            LensAngles.of(
                fit.state.lens(camera, size),
                halves.scale**2 * fit.covariance[WIDTH * camera :, WIDTH * camera :][:8, :8],
                tuple(half.lens(camera, size) for half in halves.states),
                calibration.brightest[camera],
            )
            for camera, size in enumerate(calibration.sizes)
        )

    def deviations(self, camera: int) -> dict[str, float]:
        """Return the standard deviation of each of `OF_CAMERA`, so that the halves agree."""
        variance = np.diag(self.calibration.fit.covariance)[WIDTH * camera :][:WIDTH]
        return dict(zip(OF_CAMERA, self.calibration.halves.scale * np.sqrt(variance), strict=True))

    def vertical_deg(self, camera: int) -> float:
        """Return by how much the vertical is uncertain in a camera's frame, deg."""
        told = self.deviations(camera)
        attitudes = [half.attitudes[camera] for half in self.calibration.halves.states]
        halves = np.linalg.norm(np.subtract(*(attitude[1] for attitude in attitudes)))
        sigma = max(float(np.hypot(told['turn_x'], told['turn_z'])), float(halves) / 2)
        return float(np.degrees(SIGMAS * with_common(sigma, self.lenses[camera].lens)))

    def rotation_deg(self, left: int, right: int) -> float:
        """Return by how much the rotation between two cameras is uncertain, deg."""
        calibration = self.calibration
        index = [WIDTH * camera + turn for camera in (left, right) for turn in _TURNS]
        between = np.hstack([-np.eye(3), np.eye(3)])
        covariance = between @ calibration.fit.covariance[np.ix_(index, index)] @ between.T
        one, other = (
            half.attitudes[left].T @ half.attitudes[right] for half in calibration.halves.states
        )
        sigma = calibration.halves.scale * float(np.sqrt(np.trace(covariance)))
        sigma = max(sigma, float(angle_between(one, other)) / 2)
        return float(np.degrees(SIGMAS * with_common(sigma, self.lenses[left].lens)))

    @cached_property
    def doubts(self) -> list[str]:
        """What speaks against using the calibration; empty if nothing does."""
        return [*self._doubts_of_cameras(), *self._doubts_of_rig()]

    def _doubts_of_cameras(self) -> Iterator[str]:
        calibration = self.calibration
        for camera, (name, lens) in enumerate(zip(calibration.cameras, self.lenses, strict=True)):
            uncertain = SIGMAS * lens.worst_deg
            if not uncertain <= _MAX_ANGLE_DEG:
                yield (
                    f'angles of {name} are uncertain by {uncertain:.2f} degrees '
                    f'{lens.worst_place} (expected at most {_MAX_ANGLE_DEG})'
                )
            focal = self.deviations(camera)['focal_x_px'] / lens.lens.focal_x_px
            if not SIGMAS * focal <= _MAX_FOCAL:
                yield f'the focal length of {name} is uncertain by {SIGMAS * focal:.1%}'
            reach, edge = self.reach_deg(camera), np.degrees(lens.edge_rad)
            if reach < _MIN_REACH * edge:
                yield f'{name} shows {edge:.0f} degrees, and nothing was found beyond {reach:.0f}'
            noise = calibration.fit.noise_px
            if noise > _MAX_NOISE_WIDTHS * lens.lens.width:
                yield f'what {name} saw scatters by {noise:.2f} px'
            shared = self.shared(camera)
            if len(calibration.cameras) > 1 and shared < _MIN_SHARED:
                yield f'only {shared} landmarks of {name} were seen by other cameras too'

    def _doubts_of_rig(self) -> Iterator[str]:
        calibration, state = self.calibration, self.calibration.fit.state
        cameras = range(len(calibration.cameras))
        is_uncertain = any(SIGMAS * lens.worst_deg > _MAX_ANGLE_DEG for lens in self.lenses)
        if is_uncertain and max(map(state.off_axis, cameras)) < _ON_AXIS:
            yield (
                'the cameras are on the axis of the turn, where a turn tells little of lenses '
                'that are nearly stereographic: turn with them 10 cm off it'
            )
        for camera, name in enumerate(calibration.cameras):
            if not (told := self.vertical_deg(camera)) <= _MAX_ROTATION_DEG:
                yield f'the vertical of {name} is uncertain by {told:.2f} degrees'
            if (away := state.off_axis(camera)) > _MAX_OFF_AXIS:
                yield (
                    f'{name} is off the axis by {away:.0%} of the usual distance of things: turn '
                    'where they are farther away'
                )
        for left, right in pairwise(cameras):
            if not (told := self.rotation_deg(left, right)) <= _MAX_ROTATION_DEG:
                yield (
                    f'the rotation from {calibration.cameras[left]} to '
                    f'{calibration.cameras[right]} is uncertain by {told:.2f} degrees'
                )
        if calibration.found_share < _MIN_FOUND:
            yield (
                f'only {calibration.found_share:.0%} of the landmarks were found again where they '
                'should be: too much moved, or hid behind other things'
            )

    def reach_deg(self, camera: int) -> float:
        """Return the angle from the axis out to which landmarks were seen, deg."""
        fit = self.calibration.fit
        x, y, z = fit.state.rays(fit.seen.only(fit.seen.camera == camera)).T
        return float(np.degrees(np.percentile(np.arctan2(np.hypot(x, y), z), 99.5)))

    def shared(self, camera: int) -> int:
        """Return the number of landmarks that a camera has in common with others."""
        seen = self.calibration.fit.seen
        mine = seen.camera == camera
        return len(np.intersect1d(seen.landmark[mine], seen.landmark[~mine]))
