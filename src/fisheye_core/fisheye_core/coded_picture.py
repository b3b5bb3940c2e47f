"""Coded pictures: decoded only after their head said how large they will be."""

import struct
import warnings
from contextlib import suppress
from io import BytesIO

import cv2
import numpy as np

from fisheye_core.errors import ImageFormatError
from fisheye_core.quiet_jpeg import without_libjpeg_lines

_PNG = b'\x89PNG\r\n\x1a\n'
_JPEG = b'\xff\xd8'
_HEIF_BRANDS = (b'heic', b'heix', b'hevc', b'heim', b'heis', b'mif1', b'msf1')
_END = b'\xff\xd9'
_SCAN = b'\xff\xda'
_MAX_PIXELS = 50_000_000
"""A few bytes can claim to be more than fits into memory."""
_OTHER_KINDS = 'BMP', 'JPEG2000', 'PPM', 'TIFF', 'WEBP'
_NO_FRAMES = 0xC4, 0xC8, 0xCC
"""Markers of tables among those that begin a frame."""


def size_of(coded: np.ndarray) -> tuple[int, int]:
    """Return the width and height, px, that a JPEG or PNG claims to have.

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
    data = coded.data
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
    raise ImageFormatError(f'{len(data)} bytes are not an image; expected JPEG or PNG')


def whole_jpeg(coded: np.ndarray) -> np.ndarray | None:
    """Return a JPEG (n,) uint8 without what lies behind its end; None if it is torn before."""
    data = coded.tobytes()
    # An end before the scan is that of a thumbnail; within it no pixels look like an end.
    at = len(_JPEG)
    while data[at : at + 1] == b'\xff' and data[at : at + 2] != _SCAN:
        at += 1 if data[at + 1 : at + 2] == b'\xff' else 2 + _number(data[at + 2 : at + 4])
    end = data.find(_END, at)
    return None if end < 0 or data[at : at + 2] != _SCAN else coded[: end + len(_END)]


def decoded(coded: np.ndarray, *, grey: bool = False) -> np.ndarray:
    """Decode a JPEG or PNG as `pixels_of` does, if its head claims a size that is possible.

    Raises
    ------
    ImageFormatError
        If it is no picture, one that is too large, or not of the size that its head claims.
    """
    width, height = size_of(coded)
    image = pixels_of(coded, grey=grey)
    if image.shape[:2] != (height, width):
        raise ImageFormatError(
            f'a picture of {image.shape[1]}x{image.shape[0]} px claims {width}x{height} px'
        )
    return image


def pixels_of(coded: np.ndarray, *, grey: bool = False) -> np.ndarray:
    """Decode a picture of any kind, its pixels as the sensor gave them.

    What EXIF says of the camera's orientation is left aside: a calibration knows nothing of a
    turned picture.

    Parameters
    ----------
    coded
        (n,) uint8.
    grey
        Whether it is wanted without colour.

    Returns
    -------
    ndarray
        (height, width, 3) uint8 BGR, or (height, width) uint8.

    Raises
    ------
    ImageFormatError
        If it is broken, of no known kind, or too large for OpenCV.
    """
    _check_claim(coded)
    kind = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR
    image: np.ndarray | None = None
    with without_libjpeg_lines(), suppress(cv2.error):
        image = cv2.imdecode(coded, kind | cv2.IMREAD_IGNORE_ORIENTATION)
    if image is None:
        raise ImageFormatError(_why_not(coded))
    return image


def _why_not(coded: np.ndarray) -> str:
    """Return why a picture cannot be decoded to 8 bits."""
    image: np.ndarray | None = None
    with suppress(cv2.error):
        image = cv2.imdecode(coded, cv2.IMREAD_UNCHANGED)
    if image is not None:
        return f'its pixels are {image.dtype}; expected whole numbers of 8 or 16 bits'
    return f'{coded.size} bytes are a broken picture'


def _check_claim(coded: np.ndarray) -> None:
    """Refuse a picture whose head claims a size that no camera has."""
    try:
        width, height = size_of(coded)
    except ImageFormatError:
        width, height = _size_of_other(coded)
    if not 1 <= width * height <= _MAX_PIXELS:
        raise ImageFormatError(
            f'a picture of {width}x{height} px; expected up to {_MAX_PIXELS / 1e6:g} million px'
        )


def _size_of_other(coded: np.ndarray) -> tuple[int, int]:
    """Return the width and height, px, that a picture of another kind than JPEG or PNG claims."""
    from PIL import Image  # Not before: what cameras send needs none of it.

    Image.MAX_IMAGE_PIXELS = None  # Its own limit is a larger one, and its sentence has no size.
    try:
        with warnings.catch_warnings():
            warnings.simplefilter('ignore')  # Of what is odd in tags that nobody needs.
            with Image.open(BytesIO(coded.tobytes()), formats=_OTHER_KINDS) as picture:
                return picture.size
    except (OSError, ValueError, SyntaxError, TypeError, KeyError, struct.error) as error:
        if coded[4:8].tobytes() == b'ftyp' and coded[8:12].tobytes() in _HEIF_BRANDS:
            raise ImageFormatError(
                'it is HEIC, which OpenCV cannot decode; expected JPEG, PNG or TIFF: '
                'convert it first'
            ) from error
        raise ImageFormatError(f'{coded.size} bytes are a broken picture') from error


def _number(data: bytes | memoryview) -> int:
    return int.from_bytes(data, 'big')
