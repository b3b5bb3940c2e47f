"""Write the report beside a calibration file: what is known of the lens, for programs."""

import json
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import numpy as np

from fisheye_core.errors import FileAccessError
from fisheye_core.regular_file import replace_regular
from fisheye_undistort.fit.estimate import rms
from fisheye_undistort.fit.sheet_model import UNKNOWNS
from fisheye_undistort.report.report import CalibrationReport


def calibrated_line(report: CalibrationReport) -> str:
    """Return the comment of the calibration file."""
    views, rms_px = len(report.calibration.views), report.calibration.rms_px
    return (
        f'calibrated out to {report.certainty.calibrated_deg:.1f} degrees from the axis, from '
        f'{views} views with an rms of {rms_px:.3f} px, {_now():%Y-%m-%d}'
    )


def write_report(path: str | Path, report: CalibrationReport, name: str) -> None:
    """Write the report of a camera of this name as JSON.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    text = json.dumps(_facts(report, name), indent=1) + '\n'
    try:
        replace_regular(path, text)
    except OSError as error:
        raise FileAccessError(path, 'written', error.strerror) from error


def _facts(report: CalibrationReport, name: str) -> dict[str, Any]:
    calibration = report.calibration
    lens, halves, misfit = calibration.lens, calibration.halves, report.certainty.misfit
    views = zip(calibration.views, calibration.estimate.residuals_px, strict=True)
    return {
        'camera_name': name,
        'date': _now().isoformat(timespec='seconds'),
        'verdict': report.verdict,
        'good': report.good,
        'calibrated_deg': round(report.certainty.calibrated_deg, 2),
        'picture_deg': round(float(np.degrees(report.edge_rad)), 2),
        'width': lens.width,
        'height': lens.height,
        'rms_px': calibration.rms_px,
        'held_out_rms_px': halves.held_out_px if halves else None,
        'deviations_enlarged': halves.excess if halves else None,
        'misfit_px': misfit.typical_px,
        'unknowns': dict(zip(UNKNOWNS, calibration.estimate.unknowns.tolist(), strict=True)),
        'deviations': calibration.deviations,
        'covariance': calibration.covariance.tolist(),
        'target': str(calibration.target),
        'views': [
            {'name': view.name, 'points': len(view.ids), 'rms_px': rms(residuals)}
            for view, residuals in views
        ],
        'turned': list(calibration.turned),
        'left_out': list(calibration.outlying),
        'not_used': {**report.skipped, **calibration.dropped},
    }


def _now() -> datetime:
    return datetime.now(timezone.utc).astimezone()
