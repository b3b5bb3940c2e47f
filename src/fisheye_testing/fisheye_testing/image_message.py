"""Image messages for tests, made of arrays and back."""

from array import array

import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header


def to_message(image: np.ndarray, encoding: str, header: Header) -> Image:
    """Copy an array (height, width[, 3]) uint8 into a new message."""
    height, width = image.shape[:2]
    message = Image(header=header, width=width, height=height, encoding=encoding)
    message.step = image[0].nbytes
    message.data = array('B', np.ascontiguousarray(image).tobytes())
    return message


def to_array(message: Image) -> np.ndarray:
    """Return the pixels of a message in bgr8, rgb8 or mono8, (height, width[, 3]) uint8."""
    shape = (message.height, message.width, message.step // message.width)
    pixels = np.frombuffer(message.data, np.uint8).reshape(shape)
    return pixels[..., 0] if shape[2] == 1 else pixels


def stamp_ns(header: Header) -> int:
    """Return a header's stamp, ns."""
    return header.stamp.sec * 1_000_000_000 + header.stamp.nanosec
