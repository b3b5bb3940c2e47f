"""sensor_msgs/Image to arrays and back, without a copy wherever the layout allows."""

import re
from array import array
from dataclasses import dataclass

import cv2
import numpy as np
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from fisheye_core.coded_picture import decoded
from fisheye_core.encodings import CHANNELS, to_opencv
from fisheye_core.errors import ImageFormatError
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX


@dataclass(frozen=True)
class _Format:
    """How the pixels of one encoding lie in memory and become one of `CHANNELS`."""

    channels: int
    conversion: int | None = None
    block: int = 1
    """Width and height must be multiples of it: pixels that share colour."""
    depth: int = 1
    """Bytes of a value, of which the most significant one is taken."""
    name: str = 'bgr8'
    """Of `CHANNELS`: what it becomes."""


_YUY2 = _Format(2, cv2.COLOR_YUV2BGR_YUY2, 2)
_UYVY = _Format(2, cv2.COLOR_YUV2BGR_UYVY, 2)
# OpenCV names a Bayer pattern by its second row and column, ROS by its first.
_BAYER = {
    'rggb': cv2.COLOR_BayerBG2BGR,
    'bggr': cv2.COLOR_BayerRG2BGR,
    'gbrg': cv2.COLOR_BayerGR2BGR,
    'grbg': cv2.COLOR_BayerGB2BGR,
}
_FORMATS = {
    'bgr8': _Format(3),
    'rgb8': _Format(3, name='rgb8'),
    'mono8': _Format(1, name='mono8'),
    '8UC3': _Format(3),
    '8UC1': _Format(1, name='mono8'),
    'mono16': _Format(1, depth=2, name='mono8'),
    'bgra8': _Format(4, cv2.COLOR_BGRA2BGR),
    'rgba8': _Format(4, cv2.COLOR_RGBA2BGR),
    'yuv422_yuy2': _YUY2,
    'yuyv': _YUY2,
    'uyvy': _UYVY,
    'yuv422': _UYVY,
    **{f'bayer_{pattern}8': _Format(1, code, 2) for pattern, code in _BAYER.items()},
    **{f'bayer_{pattern}16': _Format(1, code, 2, depth=2) for pattern, code in _BAYER.items()},
}
_COMPRESSED_COLOR = re.compile(r'compressed (rgb|bgr)')


def to_array(message: Image) -> tuple[np.ndarray, str]:
    """Return the pixels of a message.

    Parameters
    ----------
    message
        An image of values of 8 bits, or of 16, of which the upper 8 are taken; padded rows are
        fine.

    Returns
    -------
    image : ndarray
        (height, width[, 3]) uint8: the message's own memory where its encoding is one of
        `CHANNELS`, a new array otherwise.
    encoding : str
        Of the array, one of `CHANNELS`.

    Raises
    ------
    ImageFormatError
        For an encoding that is not known, and for a size that does not fit the data.
    """
    form = _FORMATS.get(message.encoding)
    if form is None:
        raise ImageFormatError(
            f"encoding '{message.encoding:.40}' is not taken; "
            f'expected one of {", ".join(_FORMATS)}'
        )
    width, height, step = message.width, message.height, message.step
    size = f'an image of {width}x{height} px in {message.encoding}'
    if not (1 <= width <= MAX_PICTURE_SIDE_PX and 1 <= height <= MAX_PICTURE_SIDE_PX):
        raise ImageFormatError(f'{size}; expected sides of 1 to {MAX_PICTURE_SIDE_PX} px')
    _check_block(form, width, height, message.encoding)
    row = width * form.channels * form.depth
    if step < row:
        raise ImageFormatError(f'{size} has rows of {step} bytes; expected {row}')
    if len(message.data) != step * height:
        raise ImageFormatError(f'{size} has {len(message.data)} bytes; expected {step * height}')
    shape = (height, width) if form.channels == 1 else (height, width, form.channels)
    strides = (step, form.depth) if form.channels == 1 else (step, form.channels, 1)
    upper = 0 if message.is_bigendian else form.depth - 1
    pixels: np.ndarray = np.ndarray(shape, np.uint8, message.data, upper, strides)
    if form.depth > 1:
        pixels = np.ascontiguousarray(pixels)
    if form.conversion is not None:
        pixels = cv2.cvtColor(pixels, form.conversion)
    return pixels, form.name


def _check_block(form: _Format, width: int, height: int, encoding: str) -> None:
    if form.block > 1 and (width % 2 or (height % 2 and form.channels == 1)):
        raise ImageFormatError(
            f'an image of {width}x{height} px in {encoding}; this encoding shares colour and '
            'needs an even size'
        )


class ImageBuffer:
    """An Image message whose pixels are an array: what is drawn there is what gets published.

    Publishing copies the message, so one buffer serves every frame.

    Attributes
    ----------
    message : Image
        Complete but for its header.
    array : ndarray
        (height, width[, 3]) uint8 view of the message's data.
    """

    def __init__(self, width: int, height: int, encoding: str):
        channels = CHANNELS[encoding]
        step = width * channels
        self.message = Image(width=width, height=height, encoding=encoding, step=step)
        self.message.data = array('B', bytes(step * height))
        shape = (height, width) if channels == 1 else (height, width, channels)
        self.array = np.frombuffer(self.message.data, np.uint8).reshape(shape)

    def fits(self, width: int, height: int, encoding: str) -> bool:
        """Whether the buffer holds images of this size and encoding."""
        message = self.message
        return (width, height, encoding) == (message.width, message.height, message.encoding)


def to_jpeg(image: np.ndarray, encoding: str, header: Header, quality: int) -> CompressedImage:
    """Encode an array as the message that image_transport's `compressed` plugin reads.

    Parameters
    ----------
    image
        (height, width[, 3]) uint8.
    encoding
        One of `CHANNELS`.
    quality
        JPEG quality, 1 to 100.
    """
    _, coded = cv2.imencode(
        '.jpg', to_opencv(image, encoding), (cv2.IMWRITE_JPEG_QUALITY, quality)
    )
    return jpeg_message(coded, encoding, header)


def jpeg_message(coded: np.ndarray, encoding: str, header: Header) -> CompressedImage:
    """Build the same message from a JPEG, (n,) uint8."""
    stored = '' if encoding == 'mono8' else 'bgr8'
    message = CompressedImage(header=header, format=f'{encoding}; jpeg compressed {stored}')
    data = array('B')
    data.frombytes(coded.data.cast('B'))
    message.data = data
    return message


def from_jpeg(message: CompressedImage) -> tuple[np.ndarray, str]:
    """Decode a compressed picture to (height, width[, 3]) uint8 and its encoding.

    `format` begins with the encoding of what was compressed; a Bayer mosaic was compressed as
    grey. Where it says nothing, the picture is taken in colour.

    Raises
    ------
    ImageFormatError
        If the data is no picture, or one that is too large.
    """
    encoding = message.format.partition(';')[0].strip()
    form = _FORMATS.get(encoding, _FORMATS['bgr8'])
    grey = form.channels == 1
    image = decoded(np.frombuffer(message.data, np.uint8), grey=grey)
    if grey:
        if form.conversion is not None:
            height, width = image.shape
            _check_block(form, width, height, encoding)
            image = cv2.cvtColor(image, form.conversion)
        return image, form.name
    stored = _COMPRESSED_COLOR.search(message.format)
    return image, 'rgb8' if stored and stored[1] == 'rgb' else 'bgr8'
