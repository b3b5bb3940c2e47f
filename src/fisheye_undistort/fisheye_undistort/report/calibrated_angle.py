"""How far a lens was calibrated, as the report beside its calibration file says."""

import json
from pathlib import Path

import numpy as np

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import Lens
from fisheye_undistort.fit.sheet_model import INTRINSICS, lens_of

_SUFFIX = '.report.json'


def report_path(camera_file: str | Path) -> Path:
    """Return where the report of a calibration file lies: `left.report.json` of `left.yaml`."""
    return Path(camera_file).with_suffix(_SUFFIX)


def calibrated_deg(camera_file: str | Path, lens: Lens) -> float | None:
    """Return the angle out to which a camera was calibrated.

    Parameters
    ----------
    camera_file
        Its calibration file.
    lens
        What that file says of it.

    Returns
    -------
    float or None
        Degrees from the axis; None where nobody wrote it, or of a lens that was since replaced.
    """
    try:
        facts = json.loads(report_path(camera_file).read_text())
        unknowns = np.array([facts['unknowns'][name] for name in INTRINSICS])
        is_of_lens = lens_of(unknowns, (facts['width'], facts['height'])) == lens
        return float(facts['calibrated_deg']) if is_of_lens else None
    except (OSError, ValueError, KeyError, TypeError, CalibrationError):
        return None
