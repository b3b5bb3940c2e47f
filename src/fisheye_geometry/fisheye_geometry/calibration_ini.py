"""INI calibrations as camera_calibration_parsers reads them, as the calibrator's `ost.txt`."""

import re

from fisheye_core.errors import CameraFileError
from fisheye_core.plain_yaml import Mapping

_BEGIN = re.compile(r'(\s|[#;][^\n]*\n)*\[[^\[\]\n]+\][ \t]*$', re.MULTILINE)
_MATRICES = {
    'camera matrix': 'camera_matrix',
    'distortion': 'distortion_coefficients',
    'rectification': 'rectification_matrix',
    'projection': 'projection_matrix',
}
_SIZES = {'width': 'image_width', 'height': 'image_height'}
_NO_CAMERA = 'image', 'externals'
_PLUMB_BOB, _RATIONAL = 5, (8, 12, 14)


def is_ini(text: str) -> bool:
    """Whether a text begins as an INI file does: a section before all else."""
    return bool(_BEGIN.match(text))


def parse_ini(text: str) -> Mapping:
    """Return what a text says with the keys of a camera_info YAML file.

    The format names no distortion model: five numbers are `plumb_bob`, eight and more
    `rational_polynomial`, as camera_calibration_parsers has it.

    Raises
    ------
    CameraFileError
        If a line is none of the format, or the model cannot be told; the sentence names it.
    """
    entries = Mapping()
    entries['camera_name'] = entries.texts['camera_name'] = ''
    key = ''
    for line, words in enumerate(text.splitlines(), 1):
        words = words.strip()
        if not words or words[0] in '#;':
            continue
        if words[0] == '[' and words[-1] == ']':
            name, key = words[1:-1], ''
            if name not in _NO_CAMERA:
                entries['camera_name'] = entries.texts['camera_name'] = name
        elif words[0].isalpha():
            key = _MATRICES.get(words) or _SIZES.get(words, '')
            if key:
                entries.lines[key] = line
                entries[key] = {'data': []} if words in _MATRICES else None
        elif key:
            numbers = [_number(word, line) for word in words.split()]
            if isinstance(entries[key], dict):
                entries[key]['data'] += numbers
            elif len(numbers) == 1:
                entries[key] = numbers[0]
    count = len(entries.get('distortion_coefficients', {'data': ()})['data'])
    if count == _PLUMB_BOB or count in _RATIONAL:
        model = 'plumb_bob' if count == _PLUMB_BOB else 'rational_polynomial'
        entries['distortion_model'] = entries.texts['distortion_model'] = model
        return entries
    at = entries.at('distortion_coefficients')
    raise CameraFileError(
        f'{at}distortion has {count} numbers; in an INI file 5 mean '
        'plumb_bob, 8, 12 or 14 rational_polynomial; expected a YAML file for another lens'
    )


def _number(word: str, line: int) -> float:
    try:
        return float(word)
    except ValueError as error:
        raise CameraFileError(f"line {line}: '{word:.40}' is not a number") from error
