"""What a calibration is worth: figures, and a verdict with its reasons."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fisheye_geometry.image_circle import ImageCircle
from fisheye_undistort.fit.calibration import Calibration
from fisheye_undistort.fit.lens_fit import GROUPS
from fisheye_undistort.fit.lens_prior import assumed_deviations
from fisheye_undistort.fit.sheet_model import UNKNOWNS
from fisheye_undistort.report.certainty import LIMIT_DEG, Certainty
from fisheye_undistort.report.misfit import RING_DEG, SECTORS, sector_of
from fisheye_undistort.report.report_text import report_lines

_MIN_VIEWS = 5
_MAX_RMS_WIDTHS = 1 / 1200
"""Scatter of the points, in widths of the picture: half a pixel at 640."""
_MAX_MISFIT_DEG = 0.1
"""What the model may leave."""
_ASSUMED = 0.7
"""Share of what was known before, above which the points told nothing."""
_MOST_GAPS = 3


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
    seam_deg
        Angle from the axis up to which the lens must be known; 0: all that the picture shows.
    """

    calibration: Calibration
    brightest: np.ndarray
    skipped: dict[str, str]
    seam_deg: float = 0.0

    @cached_property
    def certainty(self) -> Certainty:
        """How well the lens is known over the picture."""
        return Certainty(self.calibration, self.brightest, self.seam_deg)

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
        np.add.at(counts, (ring, sector_of(azimuth)), 1)
        return counts

    @cached_property
    def doubts(self) -> list[str]:
        """What speaks against using the calibration; empty if nothing does."""
        return [*self._doubts_of_views(), *self._doubts_of_fit()]

    def _doubts_of_views(self):
        views = len(self.calibration.views)
        if views < _MIN_VIEWS:
            yield f'only {views} view{"s" * (views > 1)} (expected {_MIN_VIEWS} and more)'
        yield from map(str, self.certainty.gaps[:_MOST_GAPS])

    def _doubts_of_fit(self):
        calibration, misfit = self.calibration, self.certainty.misfit
        width = calibration.lens.width
        if calibration.rms_px > _MAX_RMS_WIDTHS * width:
            yield (
                f'the points scatter by {calibration.rms_px:.2f} px (expected at most '
                f'{_MAX_RMS_WIDTHS * width:.1f})'
            )
        off_deg = np.degrees(misfit.typical_rad)
        if off_deg > _MAX_MISFIT_DEG:
            yield (
                f'the model of Kannala and Brandt leaves {misfit.typical_px:.2f} px '
                f'({off_deg:.2f} degrees) that all views share'
            )
        if len(calibration.views) < _MIN_VIEWS and self.assumed:
            yield f'{", ".join(self.assumed)} could only be assumed'

    @cached_property
    def assumed(self) -> list[str]:
        """Groups of unknowns of which the points told nothing that was not known before."""
        calibration = self.calibration
        size = (calibration.lens.width, calibration.lens.height)
        before = assumed_deviations(
            calibration.estimate.unknowns, size, calibration.target.points_mm
        )
        now = np.array([*calibration.deviations.values()])
        told = dict(zip(UNKNOWNS, now < _ASSUMED * before, strict=True))
        return [
            name
            for name, directions in GROUPS.items()
            if not any(told[UNKNOWNS[i]] for i in np.flatnonzero(np.any(directions, axis=0)))
        ]

    @property
    def good(self) -> bool:
        """Whether nothing speaks against using the calibration."""
        return not self.doubts

    @property
    def verdict(self) -> str:
        """One sentence."""
        if self.good:
            return (
                f'good: {len(self.calibration.views)} views fit to '
                f'{self.calibration.rms_px:.2f} px, and the lens is known to {LIMIT_DEG:g} '
                f'degrees out to {self.certainty.calibrated_deg:.0f} degrees from its axis'
            )
        return f'poor: {"; ".join(self.doubts)}'

    def __str__(self):
        return '\n'.join(report_lines(self))
