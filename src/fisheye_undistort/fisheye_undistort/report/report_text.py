"""The report on a calibration as text."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from fisheye_undistort.fit.estimate import rms
from fisheye_undistort.fit.sheet_model import INTRINSICS
from fisheye_undistort.report.certainty import LIMIT_DEG
from fisheye_undistort.report.misfit import DIRECTIONS, RING_DEG, SECTORS

if TYPE_CHECKING:
    from fisheye_undistort.report.report import CalibrationReport

_BAR = 30


def report_lines(report: CalibrationReport) -> Iterator[str]:
    """Return the lines of a report, the verdict last."""
    for part in (_views, _lens, _trust, _covered):
        yield from part(report)
    yield f'verdict  {report.verdict}'


def unknown_lines(unknowns: np.ndarray, deviations: dict[str, float]) -> Iterator[str]:
    """Return a line for each unknown, by the names in `deviations`."""
    for (name, deviation), value in zip(deviations.items(), unknowns, strict=True):
        digits = 3 if name not in INTRINSICS or name.endswith('px') else 6
        yield f'  {name:14} {value:12.{digits}f}  +- {deviation:.{digits}f}'


def _views(report: CalibrationReport):
    calibration = report.calibration
    yield f'target   {calibration.target}'
    yield f'views    {len(calibration.views)} used, rms {calibration.rms_px:.3f} px in all'
    for view, residuals in zip(calibration.views, calibration.estimate.residuals_px, strict=True):
        yield f'  {view.name:30} {len(view.ids):4} points  rms {rms(residuals):.3f} px'
    for name, reason in {**report.skipped, **calibration.dropped}.items():
        yield f'  {name:30} not used: {reason}'
    if calibration.turned:
        count, views = len(calibration.turned), len(calibration.views)
        yield f'turned   {count} of {views} pictures are turned by 180 degrees to the others'
        yield f'  and were turned back: {", ".join(calibration.turned)}'
    for point in calibration.outlying:
        yield f'  left out: {point}'


def _lens(report: CalibrationReport):
    calibration = report.calibration
    unknowns, deviations = calibration.estimate.unknowns, calibration.deviations
    yield f'lens     Kannala-Brandt, {calibration.lens.width} x {calibration.lens.height} px'
    if report.assumed:
        yield f'assumed  {", ".join(report.assumed)}: as with most lenses, the points tell less'
    yield from unknown_lines(unknowns, deviations)


def _trust(report: CalibrationReport):
    certainty, halves = report.certainty, report.calibration.halves
    if halves:
        apart = np.degrees(halves.difference_rad(report.calibration.angles.pixels))
        apart = apart[certainty.lit & (certainty.angle_deg <= certainty.calibrated_deg)]
        yield (
            f'halves   even and odd views: held-out rms {halves.held_out_px:.3f} px, lenses '
            f'differ by up to {np.nanmax(apart, initial=0.0):.2f} degrees where calibrated, '
            f'deviations enlarged {halves.excess:.1f} times'
        )
    yield f'model    {_misfit(report)}'
    yield (
        f'certain  to {LIMIT_DEG:g} degrees out to {certainty.calibrated_deg:.0f} degrees '
        'from the axis, all around'
    )


def _misfit(report: CalibrationReport) -> str:
    misfit = report.certainty.misfit
    if misfit.worst is None:
        return 'Kannala-Brandt leaves nothing that the views share'
    at, size_px = misfit.worst, misfit.size_px[misfit.worst]
    size_deg = np.degrees(size_px / misfit.px_per_rad[at])
    ring = int(misfit.ring_deg[at])
    return (
        f'Kannala-Brandt leaves {misfit.typical_px:.3f} px that all views share, most '
        f'({size_px:.2f} px, {size_deg:.3f} degrees) at {ring}-{ring + RING_DEG} degrees '
        f'{DIRECTIONS[misfit.sector[at]]}'
    )


def _covered(report: CalibrationReport):
    edge = np.degrees(report.edge_rad)
    yield f'coverage points by angle from the axis; the picture shows {edge:.0f} degrees'
    counts = report.coverage.sum(axis=1)
    for ring, (count, row) in enumerate(zip(counts, report.coverage, strict=True)):
        bar = '#' * int(np.ceil(_BAR * count / counts.max()))
        span = f'{ring * RING_DEG}-{(ring + 1) * RING_DEG}'
        sectors = np.count_nonzero(row)
        yield f'  {span:>7} deg {count:5} in {sectors} of {SECTORS} directions  {bar}'
