"""How far a lens was calibrated, as the report beside its calibration file says."""

import json
from pathlib import Path

_SUFFIX = '.report.json'


def report_path(camera_file: str | Path) -> Path:
    """Return where the report of a calibration file lies: `left.report.json` of `left.yaml`."""
    return Path(camera_file).with_suffix(_SUFFIX)


def calibrated_deg(camera_file: str | Path) -> float | None:
    """Return the angle out to which a camera was calibrated; None where nobody wrote it."""
    try:
        value = json.loads(report_path(camera_file).read_text())['calibrated_deg']
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return float(value) if isinstance(value, int | float) else None
