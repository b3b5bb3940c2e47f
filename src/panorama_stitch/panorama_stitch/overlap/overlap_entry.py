"""What an overlap file says of one pair of neighbours."""

from math import degrees, inf, radians

from fisheye_core.errors import OverlapFileError
from fisheye_core.yaml_file import is_number, shown
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, attitude_at
from panorama_stitch.overlap.overlap_settings import METHODS

_LARGEST_TILT_DEG = {1: 45.0, 2: 180.0}
_NUMBERS = ('offset_x_px', 'offset_y_px', 'pitch_deg', 'roll_deg', 'overlap_px', 'confidence')
_NUMBERS_2 = (*_NUMBERS, 'near_deg')


def overlap_entry(left: str, right: str, overlap: Overlap) -> dict:
    """Return what a file says of an overlap."""
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


def overlap_of(
    version: int, names: tuple[str, str], surfaces: tuple[Surface, Surface], entry: dict
) -> Overlap:
    """Return the overlap that an entry holds.

    Parameters
    ----------
    version
        Of the file.
    names, surfaces
        Of the left and the right camera.
    entry
        As `overlap_entry` made it, or a version before.

    Raises
    ------
    OverlapFileError
        If the entry lacks something, or is for other cameras.
    """
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
            up_to = f' up to {limit:g}' if limit < inf else ''
            raise OverlapFileError(
                f'{key} of {pair} is {shown(value)}; expected a finite number{up_to}'
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
