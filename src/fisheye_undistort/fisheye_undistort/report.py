"""What a calibration is worth: figures, and a verdict with its reasons."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_geometry.image_circle import ImageCircle
from fisheye_undistort.calibration import Calibration
from fisheye_undistort.estimate import rms
from fisheye_undistort.lens_fit import GROUPS
from fisheye_undistort.sheet_model import INTRINSICS

RING_DEG = 10
"""Width of the rings in which the coverage is counted."""
SECTORS = 8

_MIN_VIEWS = 5
_MIN_REACH = 0.7
"""Share of the angle at the picture's edge up to which there must be points."""
_HALF_WAY = 0.45
_MIN_SECTORS = 6
"""Of `SECTORS`, those that must have points beyond `_HALF_WAY` to the edge."""
_MAX_RMS_WIDTHS = 1 / 1200
"""Scatter of the points, in widths of the picture: half a pixel at 640."""
_MAX_FOCAL_DEVIATION = 0.005
_MAX_CENTER_DEVIATION_WIDTHS = 0.005
_BAR = 30


@dataclass(frozen=True)
class CalibrationReport:
    """Figures of a calibration and of how well the views cover what the lens sees.

    Attributes
    ----------
    calibration
        What is reported on.
    brightest
        (height, width) uint8, the brightest that each pixel was: shows the image circle.
    skipped
        Name of each picture that gave no view, and why.
    """

    calibration: Calibration
    brightest: np.ndarray
    skipped: dict[str, str]

    @cached_property
    def edge_rad(self) -> float:
        """Largest angle that the picture shows to the sides, up or down."""
        lens = self.calibration.lens
        circle = ImageCircle(lens)
        circle.look(self.brightest)
        return min(circle.angle_rad, max(lens.field_rad()))

    @cached_property
    def coverage(self) -> np.ndarray:
        """Number of points in each ring and sector, (rings, SECTORS) int."""
        angle, azimuth = self.calibration.directions_rad
        rings = int(np.ceil(np.degrees(max(self.edge_rad, angle.max())) / RING_DEG))
        ring = (np.degrees(angle) // RING_DEG).astype(int).clip(0, rings - 1)
        counts = np.zeros((rings, SECTORS), int)
        np.add.at(counts, (ring, _sector(azimuth)), 1)
        return counts

    @cached_property
    def doubts(self) -> list[str]:
        """What speaks against using the calibration; empty if nothing does."""
        return [*self._doubts_of_views(), *self._doubts_of_fit()]

    def _doubts_of_views(self):
        views = len(self.calibration.views)
        if views < _MIN_VIEWS:
            yield f'only {views} view{"s" * (views > 1)} (expected {_MIN_VIEWS} and more)'
        angle, azimuth = self.calibration.directions_rad
        reach, edge = np.degrees([angle.max(), self.edge_rad])
        if reach < _MIN_REACH * edge:
            yield f'no points beyond {reach:.0f} degrees, and the picture shows {edge:.0f}'
        outer = azimuth[angle > _HALF_WAY * self.edge_rad]
        sectors = len(np.unique(_sector(outer)))
        if sectors < _MIN_SECTORS:
            yield (
                f'points beyond {_HALF_WAY * edge:.0f} degrees in only {sectors} of '
                f'{SECTORS} directions'
            )

    def _doubts_of_fit(self):
        calibration = self.calibration
        lens, deviations = calibration.lens, calibration.deviations
        if calibration.rms_px > _MAX_RMS_WIDTHS * lens.width:
            yield (
                f'the points scatter by {calibration.rms_px:.2f} px (expected at most '
                f'{_MAX_RMS_WIDTHS * lens.width:.1f})'
            )
        focal = deviations['focal_x_px'] / lens.focal_x_px
        if focal > _MAX_FOCAL_DEVIATION:
            yield f'the focal length is uncertain by {focal:.1%}'
        center = max(deviations['center_x_px'], deviations['center_y_px'])
        if center > _MAX_CENTER_DEVIATION_WIDTHS * lens.width:
            yield f'the principal point is uncertain by {center:.1f} px'
        if len(calibration.views) < _MIN_VIEWS and self._assumed:
            yield f'{", ".join(self._assumed)} could only be assumed'

    @property
    def _assumed(self) -> list[str]:
        """Groups of unknowns that were not fitted."""
        return [name for name in GROUPS if name not in self.calibration.estimate.free]

    @property
    def good(self) -> bool:
        """Whether nothing speaks against using the calibration."""
        return not self.doubts

    @property
    def verdict(self) -> str:
        """One sentence."""
        if self.good:
            reach = np.degrees(self.calibration.directions_rad[0].max())
            return (
                f'good: {len(self.calibration.views)} views out to {reach:.0f} degrees fit '
                f'to {self.calibration.rms_px:.2f} px'
            )
        return f'poor: {"; ".join(self.doubts)}'

    def __str__(self):
        return '\n'.join(
            [
                *self._views(),
                *self._lens(),
                *self._covered(),
                f'verdict  {self.verdict}',
            ]
        )

    def _views(self):
        calibration = self.calibration
        yield f'target   {calibration.target}'
        yield f'views    {len(calibration.views)} used, rms {calibration.rms_px:.3f} px in all'
        for view, residuals in zip(
            calibration.views, calibration.estimate.residuals_px, strict=True
        ):
            yield f'  {view.name:30} {len(view.ids):4} points  rms {rms(residuals):.3f} px'
        for name, reason in {**self.skipped, **calibration.dropped}.items():
            yield f'  {name:30} not used: {reason}'

    def _lens(self):
        calibration = self.calibration
        unknowns, deviations = calibration.estimate.unknowns, calibration.deviations
        yield f'lens     Kannala-Brandt, {calibration.lens.width} x {calibration.lens.height} px'
        yield f'fitted   {", ".join(calibration.estimate.free)}'
        if self._assumed:
            yield f'assumed  {", ".join(self._assumed)}: the points do not ask for more'
        for (name, deviation), value in zip(deviations.items(), unknowns, strict=True):
            digits = 3 if name not in INTRINSICS or name.endswith('px') else 6
            known = f'+- {deviation:.{digits}f}' if deviation else 'assumed'
            yield f'  {name:14} {value:12.{digits}f}  {known}'

    def _covered(self):
        edge = np.degrees(self.edge_rad)
        yield f'coverage points by angle from the axis; the picture shows {edge:.0f} degrees'
        counts = self.coverage.sum(axis=1)
        for ring, (count, row) in enumerate(zip(counts, self.coverage, strict=True)):
            bar = '#' * int(np.ceil(_BAR * count / counts.max()))
            span = f'{ring * RING_DEG}-{(ring + 1) * RING_DEG}'
            sectors = np.count_nonzero(row)
            yield f'  {span:>7} deg {count:5} in {sectors} of {SECTORS} directions  {bar}'


def _sector(azimuth_rad: np.ndarray) -> np.ndarray:
    """Which of `SECTORS` an angle about the axis lies in; the first is to the right."""
    return ((azimuth_rad / (2 * np.pi) + 1) * SECTORS + 0.5).astype(int) % SECTORS
