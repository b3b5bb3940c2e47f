"""sensor_msgs/Image to arrays and back, without a copy wherever the layout allows."""

from array import array
from dataclasses import dataclass

import cv2
import numpy as np
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from fisheye_geometry.coded_picture import decoded
from fisheye_geometry.encodings import CHANNELS, to_opencv
from fisheye_geometry.errors import ImageFormatError
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX


@dataclass(frozen=True)
class _Format:
    """How the pixels of one encoding lie in memory and become one of `CHANNELS`."""

    channels: int
    conversion: int | None = None
    block: int = 1
    """Width and height must be multiples of it: pixels that share colour."""


_YUY2 = _Format(2, cv2.COLOR_YUV2BGR_YUY2, 2)
_UYVY = _Format(2, cv2.COLOR_YUV2BGR_UYVY, 2)
# OpenCV names a Bayer pattern by its second row and column, ROS by its first.
_FORMATS = {
    'bgr8': _Format(3),
    'rgb8': _Format(3),
    'mono8': _Format(1),
    'bgra8': _Format(4, cv2.COLOR_BGRA2BGR),
    'rgba8': _Format(4, cv2.COLOR_RGBA2BGR),
    'yuv422_yuy2': _YUY2,
    'yuyv': _YUY2,
    'uyvy': _UYVY,
    'yuv422': _UYVY,
    'bayer_rggb8': _Format(1, cv2.COLOR_BayerBG2BGR, 2),
    'bayer_bggr8': _Format(1, cv2.COLOR_BayerRG2BGR, 2),
    'bayer_gbrg8': _Format(1, cv2.COLOR_BayerGR2BGR, 2),
    'bayer_grbg8': _Format(1, cv2.COLOR_BayerGB2BGR, 2),
}


def to_array(message: Image) -> tuple[np.ndarray, str]:
    """Give the pixels of a message.

    Parameters
    ----------
    message
        An image in one of the 8-bit encodings; padded rows are fine, byte order means nothing.

    Returns
    -------
    image : ndarray
        (height, width[, 3]) uint8: the message's own memory where its encoding is one of
        `CHANNELS`, a new array otherwise.
    encoding : str
        Of the array: the message's own, or 'bgr8' where it was converted.

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
    if form.block > 1 and (width % 2 or (height % 2 and form.channels == 1)):
        raise ImageFormatError(f'{size}; this encoding shares colour and needs an even size')
    if step < width * form.channels:
        raise ImageFormatError(
            f'{size} has rows of {step} bytes; expected {width * form.channels}'
        )
    if len(message.data) != step * height:
        raise ImageFormatError(f'{size} has {len(message.data)} bytes; expected {step * height}')
    shape = (height, width) if form.channels == 1 else (height, width, form.channels)
    strides = (step, 1) if form.channels == 1 else (step, form.channels, 1)
    pixels = np.ndarray(shape, np.uint8, message.data, strides=strides)
    if form.conversion is None:
        return pixels, message.encoding
    return cv2.cvtColor(pixels, form.conversion), 'bgr8'


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
    """Give the same for a picture that is a JPEG already, (n,) uint8."""
    stored = '' if encoding == 'mono8' else 'bgr8'
    message = CompressedImage(header=header, format=f'{encoding}; jpeg compressed {stored}')
    data = array('B')
    data.frombytes(memoryview(coded).cast('B'))
    message.data = data
    return message


def from_jpeg(message: CompressedImage) -> tuple[np.ndarray, str]:
    """Decode a compressed picture to (height, width[, 3]) uint8 and 'mono8' or 'bgr8'.

    Raises
    ------
    ImageFormatError
        If the data is no picture, or one that is too large.
    """
    grey = message.format.startswith('mono8')
    image = decoded(np.frombuffer(message.data, np.uint8), grey=grey)
    return image, 'mono8' if grey else 'bgr8'
