"""Image messages for tests, made of arrays."""

import numpy as np
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fisheye_bridge.images import ImageBuffer


def to_message(image: np.ndarray, encoding: str, header: Header) -> Image:
    """Copy an array (height, width[, 3]) uint8 into a new message."""
    buffer = ImageBuffer(image.shape[1], image.shape[0], encoding)
    buffer.array[:] = image
    buffer.message.header = header
    return buffer.message
