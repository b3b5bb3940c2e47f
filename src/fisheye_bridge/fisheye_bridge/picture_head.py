"""The head of a coded picture: how large it will be, known before anything is decoded."""

import numpy as np

from fisheye_geometry.errors import ImageFormatError

_PNG = b'\x89PNG\r\n\x1a\n'
_JPEG = b'\xff\xd8'
_NO_FRAMES = 0xC4, 0xC8, 0xCC
"""Markers of tables among those that begin a frame."""


def size_of(coded: np.ndarray) -> tuple[int, int]:
    """Give the width and height, px, that a JPEG or PNG claims to have.

    Parameters
    ----------
    coded
        (n,) uint8.

    Raises
    ------
    ImageFormatError
        If it is neither, or ends before it says.

    References
    ----------
    ITU-T T.81, annex B, and ISO/IEC 15948, section 11.2.2.
    """
    data = memoryview(coded)
    if bytes(data[:8]) == _PNG and len(data) >= 24:
        return _number(data[16:20]), _number(data[20:24])
    if bytes(data[:2]) == _JPEG:
        at = 2
        while at + 9 <= len(data) and data[at] == 0xFF:
            marker = data[at + 1]
            if marker == 0xFF:
                at += 1
            elif marker & 0xF0 == 0xC0 and marker not in _NO_FRAMES:
                return _number(data[at + 7 : at + 9]), _number(data[at + 5 : at + 7])
            else:
                at += 2 + _number(data[at + 2 : at + 4])
    raise ImageFormatError(f'{len(data)} bytes are no picture; expected JPEG or PNG')


def _number(data: memoryview) -> int:
    return int.from_bytes(data, 'big')
