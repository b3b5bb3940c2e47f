"""The overlap file: what was measured once, kept for the next start, valid for one rig only."""

import os
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.errors import FileContentError, OverlapFileError
from fisheye_core.yaml_file import is_missing, is_number, read_mapping, shown, write_mapping
from fisheye_geometry.rig import pairs_for
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_entry import overlap_entry, overlap_of
from panorama_stitch.overlap.overlap_result import Overlap

VERSION = 2
_READABLE = (1, 2)
"""Version 1 knew offsets of level cameras and small tilts, no rotation."""
SIZE_KEYS = ('width', 'height')
LENGTH_KEYS = ('focal_px', 'center_x_px', 'center_y_px')
_LENGTH_TOLERANCE_PX = 0.01
"""More than rounding, less than anybody sees."""


def write_overlaps(
    path: str | Path,
    cameras: Sequence[str],
    surfaces: Sequence[Surface],
    overlaps: Sequence[Overlap],
) -> None:
    """Write the overlaps of neighbouring cameras; readers see the old file or the new one.

    Parameters
    ----------
    path
        The file.
    cameras, surfaces
        Names from left to right, and what each camera's pictures are on.
    overlaps
        One for each pair of neighbours, in a ring the closing one last.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    write_mapping(
        os.path.expanduser(path),
        {
            'version': VERSION,
            'cameras': [_camera(*camera) for camera in zip(cameras, surfaces, strict=True)],
            'overlaps': [
                overlap_entry(cameras[left], cameras[right], overlap)
                for (left, right), overlap in zip(
                    pairs_for(len(cameras), len(overlaps)), overlaps, strict=True
                )
            ],
        },
    )


def read_overlaps(
    path: str | Path, cameras: Sequence[str], surfaces: Sequence[Surface]
) -> list[Overlap] | None:
    """Read the overlaps of a rig: no particles, the rest as it was measured; None without a file.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    OverlapFileError
        If it lacks something, or was measured on another rig; the sentence names the file and
        what does not fit.
    """
    path = os.path.expanduser(path)
    if not path or is_missing(path):
        return None
    try:
        return overlaps_in(read_mapping(path), cameras, surfaces)
    except FileContentError as error:
        raise OverlapFileError(error.reason, path) from error


def overlaps_in(
    entries: dict, cameras: Sequence[str], surfaces: Sequence[Surface]
) -> list[Overlap]:
    """Return the overlaps of what an overlap file holds, as `read_overlaps`.

    Raises
    ------
    OverlapFileError
        Likewise, but the sentence names no file.
    """
    version = entries.get('version')
    if version not in _READABLE:
        expected = ' or '.join(map(str, _READABLE))
        raise OverlapFileError(f'version is {shown(version)}; expected {expected}')
    _check_cameras(_list(entries, 'cameras'), cameras, surfaces)
    measured = _list(entries, 'overlaps')
    pairs = pairs_for(len(cameras), len(measured))
    if len(measured) != len(pairs):
        raise OverlapFileError(
            f'{len(measured)} overlaps for {len(cameras)} cameras; expected one for each '
            'pair of neighbours'
        )
    return [
        overlap_of(
            version, (cameras[left], cameras[right]), (surfaces[left], surfaces[right]), entry
        )
        for (left, right), entry in zip(pairs, measured, strict=True)
    ]


def _camera(name: str, surface: Surface) -> dict:
    numbers = {key: float(getattr(surface, key)) for key in LENGTH_KEYS}
    sizes = {key: getattr(surface, key) for key in SIZE_KEYS}
    return {'name': name, 'surface': surface.kind, **sizes, **numbers}


def _list(entries: dict, key: str) -> list[dict]:
    value = entries.get(key)
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise OverlapFileError(f'{key} is {shown(value)}; expected a list of `key: value` blocks')
    return value


def _check_cameras(entries, cameras, surfaces) -> None:
    names = [entry.get('name') for entry in entries]
    if names != list(cameras):
        raise OverlapFileError(
            f'it is for the cameras {", ".join(map(shown, names))}; these are {", ".join(cameras)}'
        )
    for entry, name, surface in zip(entries, cameras, surfaces, strict=True):
        now = _camera(name, surface)
        for key, value in now.items():
            then = entry.get(key)
            if key in LENGTH_KEYS and is_number(then):
                if abs(then - value) <= _LENGTH_TOLERANCE_PX:
                    continue
                value = round(value, 3)
            elif then == value:
                continue
            raise OverlapFileError(
                f"it was measured with camera '{name}' at {key} {shown(then)}; now it is {value}"
            )
