"""The overlap file: what was measured once, kept for the next start, valid for one rig only."""

import os
from collections.abc import Sequence
from math import degrees, inf, radians
from pathlib import Path

from fisheye_core.errors import FileContentError, OverlapFileError
from fisheye_core.yaml_file import is_missing, is_number, read_mapping, shown, write_mapping
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.rig import Pair, pairs_of
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, attitude_at
from panorama_stitch.overlap.overlap_settings import METHODS

VERSION = 2
_READABLE = (1, 2)
"""Version 1 knew offsets of level cameras and small tilts, no rotation."""
_SIZE_KEYS = ('width', 'height')
_LENGTH_KEYS = ('focal_px', 'center_x_px', 'center_y_px')
_LENGTH_TOLERANCE_PX = 0.01
"""More than rounding, less than anybody sees."""
_LARGEST_TILT_DEG = {1: 45.0, 2: 180.0}
_NUMBERS = ('offset_x_px', 'offset_y_px', 'pitch_deg', 'roll_deg', 'overlap_px', 'confidence')
_NUMBERS_2 = (*_NUMBERS, 'near_deg')


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
                _entry(cameras[left], cameras[right], overlap)
                for (left, right), overlap in zip(_pairs(cameras, overlaps), overlaps, strict=True)
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
        version = entries.get('version')
        if version not in _READABLE:
            expected = ' or '.join(map(str, _READABLE))
            raise OverlapFileError(f'version is {shown(version)}; expected {expected}')
        _check_cameras(_list(entries, 'cameras'), cameras, surfaces)
        measured = _list(entries, 'overlaps')
        pairs = _pairs(cameras, measured)
        if len(measured) != len(pairs):
            raise OverlapFileError(
                f'{len(measured)} overlaps for {len(cameras)} cameras; expected one for each '
                'pair of neighbours'
            )
        return [
            _overlap(
                version, (cameras[left], cameras[right]), (surfaces[left], surfaces[right]), entry
            )
            for (left, right), entry in zip(pairs, measured, strict=True)
        ]
    except FileContentError as error:
        raise OverlapFileError(error.reason, path) from error


def _pairs(cameras: Sequence[str], overlaps: Sequence) -> tuple[Pair, ...]:
    """Return the pairs of neighbours that so many overlaps are for."""
    return pairs_of(len(cameras), len(overlaps) == len(cameras) > 1)


def _camera(name: str, surface: Surface) -> dict:
    numbers = {key: float(getattr(surface, key)) for key in _LENGTH_KEYS}
    sizes = {key: getattr(surface, key) for key in _SIZE_KEYS}
    return {'name': name, 'surface': surface.kind, **sizes, **numbers}


def _entry(left: str, right: str, overlap: Overlap) -> dict:
    attitude = overlap.attitude or LEVEL
    values = {
        'offset_x_px': overlap.offset_x_px,
        'offset_y_px': overlap.offset_y_px,
        **({'yaw_deg': degrees(attitude.yaw_rad)} if overlap.attitude else {}),
        'pitch_deg': degrees(attitude.pitch_rad),
        'roll_deg': degrees(attitude.roll_rad),
        'near_deg': overlap.near_deg,
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


def _overlap(
    version: int, names: tuple[str, str], surfaces: tuple[Surface, Surface], entry: dict
) -> Overlap:
    left, right = names
    surface = surfaces[0]
    pair = f"the overlap of '{left}' and '{right}'"
    if (entry.get('left'), entry.get('right')) != (left, right):
        neighbours = f'{shown(entry.get("left"))}, {shown(entry.get("right"))}'
        raise OverlapFileError(f'{pair} is missing; found {neighbours}')
    # A rotation puts the right image anywhere, even on the left of the left one.
    widest = surface.width if version == 1 else inf
    limits = {
        'offset_x_px': widest,
        'offset_y_px': surface.height if version == 1 else inf,
        'yaw_deg': 360.0,
        'pitch_deg': _LARGEST_TILT_DEG[version],
        'roll_deg': _LARGEST_TILT_DEG[version],
    }
    has_yaw = version > 1 and 'yaw_deg' in entry
    for key in (*(_NUMBERS if version == 1 else _NUMBERS_2), *(['yaw_deg'] if has_yaw else [])):
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
    x_px, y_px = float(entry['offset_x_px']), float(entry['offset_y_px'])
    pitch_rad, roll_rad = radians(entry['pitch_deg']), radians(entry['roll_deg'])
    attitude = None
    if has_yaw:
        attitude = Attitude(radians(entry['yaw_deg']), pitch_rad, roll_rad)
    elif entry['found'] and version == 1:
        attitude = attitude_at(x_px, y_px, *surfaces, Attitude(0.0, pitch_rad, roll_rad))
    return Overlap(
        method=entry['method'],
        found=entry['found'],
        offset_x_px=x_px,
        offset_y_px=y_px,
        attitude=attitude,
        overlap_px=float(entry['overlap_px']),
        confidence=float(entry['confidence']),
        near_deg=float(entry.get('near_deg', 0.0)),
        message=message if isinstance(message, str) else '',
    )
