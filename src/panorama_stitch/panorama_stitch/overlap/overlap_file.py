"""The overlap file: what was measured once, kept for the next start, valid for one rig only."""

import os
from collections.abc import Sequence
from pathlib import Path

from fisheye_core.errors import FileContentError, GeometryError, OverlapFileError
from fisheye_core.yaml_file import is_missing, is_number, read_mapping, shown, write_mapping
from fisheye_geometry.rig import pairs_for
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_entry import overlap_entry, overlap_of
from panorama_stitch.overlap.overlap_result import Overlap, on_surfaces

VERSION = 2
_READABLE = (1, 2)
"""Version 1 knew offsets of level cameras and small tilts, no rotation."""
_SIZE_KEYS = ('width', 'height')
_CENTER_KEYS = ('center_x_px', 'center_y_px')
_LENGTH_KEYS = ('focal_px', *_CENTER_KEYS)
_LENS_KEY = 'lens_focal_px'
"""Of the camera's own lens: the surfaces of all cameras have the `focal_px` of the first."""
_LENGTH_TOLERANCE_PX = 0.01
"""More than rounding, less than anybody sees."""


def write_overlaps(
    path: str | Path,
    cameras: Sequence[str],
    surfaces: Sequence[Surface],
    overlaps: Sequence[Overlap],
    lens_focals_px: Sequence[float] = (),
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
    lens_focals_px
        Focal length of each camera's lens; () where it is not known.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    write_mapping(
        os.path.expanduser(path),
        {
            'version': VERSION,
            'cameras': _cameras(cameras, surfaces, lens_focals_px),
            'overlaps': [
                overlap_entry(cameras[left], cameras[right], overlap)
                for (left, right), overlap in zip(
                    pairs_for(len(cameras), len(overlaps)), overlaps, strict=True
                )
            ],
        },
    )


def read_overlaps(
    path: str | Path,
    cameras: Sequence[str],
    surfaces: Sequence[Surface],
    lens_focals_px: Sequence[float] = (),
) -> list[Overlap] | None:
    """Read the overlaps of a rig: no particles, the rest as it was measured; None without a file.

    Rotations hold for any part of what the same cameras see, and the offsets are those that they
    mean on these surfaces; an offset alone holds for the surfaces that it was measured on.

    Parameters
    ----------
    path
        The file.
    cameras, surfaces, lens_focals_px
        As of `write_overlaps`, of the cameras as they are now.

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
        return overlaps_in(read_mapping(path), cameras, surfaces, lens_focals_px)
    except FileContentError as error:
        raise OverlapFileError(error.reason, path) from error


def overlaps_in(
    entries: dict,
    cameras: Sequence[str],
    surfaces: Sequence[Surface],
    lens_focals_px: Sequence[float] = (),
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
    measured = _list(entries, 'overlaps')
    are_rotations = version > 1 and all(
        'yaw_deg' in entry or entry.get('found') is False for entry in measured
    )
    known = _list(entries, 'cameras')
    _check_names([entry.get('name') for entry in known], cameras)
    for entry, now in zip(known, _cameras(cameras, surfaces, lens_focals_px), strict=True):
        _check_camera(entry, now, are_rotations=are_rotations)
    then = surfaces_in(entries)
    pairs = pairs_for(len(cameras), len(measured))
    if len(measured) != len(pairs):
        raise OverlapFileError(
            f'{len(measured)} overlaps for {len(cameras)} cameras; expected one for each '
            'pair of neighbours'
        )
    overlaps = []
    for (left, right), entry in zip(pairs, measured, strict=True):
        on = then[left], then[right]
        overlap = overlap_of(version, (cameras[left], cameras[right]), on, entry)
        overlaps.append(on_surfaces(overlap, on, (surfaces[left], surfaces[right])))
    return overlaps


def surfaces_in(entries: dict) -> list[Surface]:
    """Return what the images of the cameras of an overlap file were on.

    Raises
    ------
    OverlapFileError
        If it does not say that; the sentence names no file.
    """
    cameras, keys = _list(entries, 'cameras'), (*_SIZE_KEYS, *_LENGTH_KEYS)
    try:
        return [Surface(entry['surface'], *(entry[key] for key in keys)) for entry in cameras]
    except (KeyError, TypeError) as error:
        raise OverlapFileError(
            f'cameras is {shown(cameras)}; expected a block with surface, {", ".join(keys)} for '
            'each'
        ) from error
    except GeometryError as error:
        raise OverlapFileError(str(error)) from error


def _cameras(
    names: Sequence[str], surfaces: Sequence[Surface], lens_focals_px: Sequence[float]
) -> list[dict]:
    """Return what a file says of cameras."""
    cameras: list[dict] = []
    for name, surface in zip(names, surfaces, strict=True):
        sizes = {key: getattr(surface, key) for key in _SIZE_KEYS}
        numbers = {key: float(getattr(surface, key)) for key in _LENGTH_KEYS}
        cameras.append({'name': name, 'surface': surface.kind, **sizes, **numbers})
    for camera, focal_px in zip(cameras, lens_focals_px, strict=False):
        camera[_LENS_KEY] = float(focal_px)
    return cameras


def _list(entries: dict, key: str) -> list[dict]:
    value = entries.get(key)
    if not isinstance(value, list) or not all(isinstance(entry, dict) for entry in value):
        raise OverlapFileError(f'{key} is {shown(value)}; expected a list of `key: value` blocks')
    return value


def _check_names(then: list, now: Sequence[str]) -> None:
    if then != list(now):
        raise OverlapFileError(
            f'it is for the cameras {", ".join(map(shown, then))}; these are {", ".join(now)}'
        )


def _check_camera(entry: dict, now: dict, *, are_rotations: bool) -> None:
    """Check that a file is of this camera; for rotations its lens is enough."""
    keys = set(now)
    if _LENS_KEY not in entry:
        keys.discard(_LENS_KEY)
    if are_rotations:
        keys -= {*_SIZE_KEYS, *_CENTER_KEYS}
        if _LENS_KEY in keys:
            keys.discard('focal_px')
    for key, value in now.items():
        then = entry.get(key)
        if key not in keys or then == value:
            continue
        if isinstance(value, float):
            if is_number(then) and abs(then - value) <= _LENGTH_TOLERANCE_PX:
                continue
            value = round(value, 3)
        raise OverlapFileError(
            f"it was measured with camera '{now['name']}' at {key} {shown(then)}; "
            f'now it is {value}'
        )
