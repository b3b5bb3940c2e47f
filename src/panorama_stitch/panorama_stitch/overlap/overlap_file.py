"""The overlap file: what was measured once, kept for the next start, valid for one rig only."""

import os
from collections.abc import Sequence
from math import degrees, inf, radians
from pathlib import Path

from fisheye_core.errors import FileContentError, OverlapFileError
from fisheye_core.yaml_file import is_missing, is_number, read_mapping, shown, write_mapping
from fisheye_geometry.remap import Turn
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.overlap.overlap_settings import METHODS

VERSION = 1
_SIZE_KEYS = ('width', 'height')
_LENGTH_KEYS = ('focal_px', 'center_x_px', 'center_y_px')
_LENGTH_TOLERANCE_PX = 0.01
"""More than rounding, less than anybody sees."""
_LARGEST_TILT_DEG = 45.0
_NUMBERS = ('offset_x_px', 'offset_y_px', 'pitch_deg', 'roll_deg', 'overlap_px', 'confidence')


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
        One for each pair of neighbours.

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
                _entry(*neighbours)
                for neighbours in zip(cameras[:-1], cameras[1:], overlaps, strict=True)
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
        entries = read_mapping(path)
        if entries.get('version') != VERSION:
            version = shown(entries.get('version'))
            raise OverlapFileError(f'version is {version}; expected {VERSION}')
        _check_cameras(_list(entries, 'cameras'), cameras, surfaces)
        measured = _list(entries, 'overlaps')
        if len(measured) != len(cameras) - 1:
            raise OverlapFileError(
                f'{len(measured)} overlaps for {len(cameras)} cameras; expected one for each '
                'pair of neighbours'
            )
        return [
            _overlap(*neighbours)
            for neighbours in zip(cameras[:-1], cameras[1:], surfaces[:-1], measured, strict=True)
        ]
    except FileContentError as error:
        raise OverlapFileError(error.reason, path) from error


def _camera(name: str, surface: Surface) -> dict:
    numbers = {key: float(getattr(surface, key)) for key in _LENGTH_KEYS}
    sizes = {key: getattr(surface, key) for key in _SIZE_KEYS}
    return {'name': name, 'surface': surface.kind, **sizes, **numbers}


def _entry(left: str, right: str, overlap: Overlap) -> dict:
    values = {
        'offset_x_px': overlap.offset_x_px,
        'offset_y_px': overlap.offset_y_px,
        'pitch_deg': degrees(overlap.turn.pitch_rad),
        'roll_deg': degrees(overlap.turn.roll_rad),
        'overlap_px': overlap.overlap_px,
        'confidence': overlap.confidence,
    }
    return {
        'left': left,
        'right': right,
        'method': overlap.method,
        'found': overlap.found,
        **{key: float(value) for key, value in values.items()},
        'message': overlap.message,
    }


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
            if key in _LENGTH_KEYS and is_number(then):
                if abs(then - value) <= _LENGTH_TOLERANCE_PX:
                    continue
                value = round(value, 3)
            elif then == value:
                continue
            raise OverlapFileError(
                f"it was measured with camera '{name}' at {key} {shown(then)}; now it is {value}"
            )


def _overlap(left: str, right: str, surface: Surface, entry: dict) -> Overlap:
    pair = f"the overlap of '{left}' and '{right}'"
    if (entry.get('left'), entry.get('right')) != (left, right):
        neighbours = f'{shown(entry.get("left"))}, {shown(entry.get("right"))}'
        raise OverlapFileError(f'{pair} is missing; found {neighbours}')
    limits = {
        'offset_x_px': surface.width,
        'offset_y_px': surface.height,
        'pitch_deg': _LARGEST_TILT_DEG,
        'roll_deg': _LARGEST_TILT_DEG,
    }
    for key in _NUMBERS:
        value = entry.get(key)
        limit = limits.get(key, inf)
        if not is_number(value) or abs(value) > limit:
            raise OverlapFileError(
                f'{key} of {pair} is {shown(value)}; expected a finite number up to {limit:g}'
            )
    if type(entry.get('found')) is not bool:
        found = shown(entry.get('found'))
        raise OverlapFileError(f'found of {pair} is {found}; expected true or false')
    if entry.get('method') not in METHODS:
        method, methods = shown(entry.get('method')), ', '.join(METHODS)
        raise OverlapFileError(f'method of {pair} is {method}; expected one of {methods}')
    message = entry.get('message')
    return Overlap(
        method=entry['method'],
        found=entry['found'],
        offset_x_px=float(entry['offset_x_px']),
        offset_y_px=float(entry['offset_y_px']),
        turn=Turn(0.0, radians(entry['pitch_deg']), radians(entry['roll_deg'])),
        overlap_px=float(entry['overlap_px']),
        confidence=float(entry['confidence']),
        message=message if isinstance(message, str) else '',
    )
