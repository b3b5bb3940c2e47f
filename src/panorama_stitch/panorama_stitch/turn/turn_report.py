"""What a calibration from a turn tells its user: figures, and a verdict with its reasons."""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from fisheye_undistort.fit.sheet_model import INTRINSICS
from fisheye_undistort.report.report_text import unknown_lines
from panorama_stitch.turn.rig_files import mounts_of
from panorama_stitch.turn.turn_certainty import SIGMAS, TurnCertainty


class TurnReport(TurnCertainty):
    """Figures of a calibration from a turn, in words."""

    @property
    def good(self) -> bool:
        """Whether there are no doubts."""
        return not self.doubts

    @property
    def verdict(self) -> str:
        """One sentence."""
        if self.doubts:
            return f'poor: {"; ".join(self.doubts)}'
        worst = SIGMAS * max(lens.worst_deg for lens in self.lenses)
        return f'good: angles are right within {worst:.2f} degrees all over the pictures'

    def __str__(self) -> str:
        return '\n'.join(
            [*self._turn(), *self._cameras(), *self._rig(), f'verdict  {self.verdict}']
        )

    def _turn(self) -> Iterator[str]:
        calibration, fit = self.calibration, self.calibration.fit
        turned = np.degrees(fit.state.angles[-1] - fit.state.angles[0])
        way = 'right' if turned > 0 else 'left'
        yield f'turn     {abs(turned):.1f} degrees to the {way}, {len(fit.state.angles)} pictures'
        yield (
            f'seen     {len(fit.state.directions)} landmarks {len(fit.seen)} times, to '
            f'{fit.noise_px:.2f} px; {calibration.found_share:.0%} of what was looked for'
        )
        yield f'halves   agree with deviations {calibration.halves.scale:.1f} times as large'

    def _cameras(self) -> Iterator[str]:
        fit = self.calibration.fit
        for camera, (name, lens) in enumerate(
            zip(self.calibration.cameras, self.lenses, strict=True)
        ):
            yield f'{name:8} Kannala-Brandt, {lens.lens.width} x {lens.lens.height} px'
            told = self.deviations(camera)
            yield from unknown_lines(
                fit.state.lenses[camera], {unknown: told[unknown] for unknown in INTRINSICS}
            )
            yield (
                f'  found out to {self.reach_deg(camera):.0f} degrees, the picture shows '
                f'{np.degrees(lens.edge_rad):.0f}; angles +- {lens.worst_deg:.3f} degrees at '
                f'worst, {lens.worst_place}'
            )

    def _rig(self) -> Iterator[str]:
        calibration, state = self.calibration, self.calibration.fit.state
        yield 'mounts   yaw, pitch, roll, deg; yaw 0 is midway from the first to the last'
        for camera, (name, mount) in enumerate(
            zip(calibration.cameras, mounts_of(state.attitudes), strict=True)
        ):
            angles = np.degrees([mount.yaw_rad, mount.pitch_rad, mount.roll_rad])
            sigma, away = self.vertical_deg(camera) / SIGMAS, state.off_axis(camera)
            yield (
                f'  {name:14} {angles[0]:8.2f} {angles[1]:8.2f} {angles[2]:8.2f}  vertical +- '
                f'{sigma:.3f}; off the axis by {away:.1%} of the usual distance'
            )
        for left, right in pairwise(range(len(calibration.cameras))):
            yield (
                f'  {calibration.cameras[left]} to {calibration.cameras[right]} +- '
                f'{self.rotation_deg(left, right) / SIGMAS:.3f}'
            )
