"""The rig that an overlap file holds, for those who have no cameras to ask."""

import os
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.errors import FileContentError, GeometryError, OverlapFileError
from fisheye_core.yaml_file import is_missing, read_mapping
from fisheye_geometry.rig import Rig
from fisheye_geometry.rig_solution import solve_rig
from panorama_stitch.overlap.overlap_file import overlaps_in, surfaces_in


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
        surfaces = surfaces_in(entries)
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
