"""The rig that an overlap file holds, for those who have no cameras to ask."""

import os
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.errors import FileContentError, GeometryError, OverlapFileError
from fisheye_core.yaml_file import is_missing, read_mapping, shown
from fisheye_geometry.rig import Rig
from fisheye_geometry.rig_solution import solve_rig
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_file import LENGTH_KEYS, SIZE_KEYS, overlaps_in

_KEYS = *SIZE_KEYS, *LENGTH_KEYS


def saved_rig(path: str | Path, cameras: Sequence[str]) -> Rig | None:
    """Return the rig of an overlap file in its level frame, as `level: symmetric` has it.

    Parameters
    ----------
    path
        The file.
    cameras
        Names from left to right.

    Returns
    -------
    Rig or None
        None where there is no file.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    OverlapFileError
        If it is no overlap file of these cameras.
    """
    path = os.path.expanduser(path)
    if is_missing(path):
        return None
    try:
        entries = read_mapping(path)
        surfaces = _surfaces(entries.get('cameras'))
        overlaps = overlaps_in(entries, cameras, surfaces)
        rotations = [None if o.attitude is None else o.attitude.matrix for o in overlaps]
        between = len(cameras) - 1
        return solve_rig(
            list(zip(cameras, surfaces, strict=True)),
            rotations[:between],
            closing=rotations[between] if len(rotations) > between else None,
        ).rig
    except (FileContentError, GeometryError) as error:
        reason = getattr(error, 'reason', str(error))
        raise OverlapFileError(
            f'it is not the overlap file of {", ".join(cameras)}: {reason}', path
        ) from error


def _surfaces(entries: object) -> list[Surface]:
    """Return what the images of the cameras were on."""
    try:
        return [Surface(entry['surface'], *(entry[key] for key in _KEYS)) for entry in entries]
    except (KeyError, TypeError) as error:
        raise OverlapFileError(
            f'cameras is {shown(entries)}; expected a block with {", ".join(_KEYS)} for each'
        ) from error
