"""Pictures as video encoders take them: planes of even sides, not larger than decoders take."""

import cv2
import numpy as np

from fisheye_core.errors import ImageFormatError

MAX_MACROBLOCKS = 36_864
MAX_SIDE_PX = 8688
"""Of level 5.1, which every decoder takes (ITU-T H.264, table A-1): 9.4 million px."""
_MACROBLOCK_PX = 16
_CONVERSIONS = {'bgr8': cv2.COLOR_BGR2YUV_I420, 'rgb8': cv2.COLOR_RGB2YUV_I420}


def to_planes(image: np.ndarray, encoding: str) -> np.ndarray:
    """Convert a picture to planar 4:2:0 (height * 3 / 2, width) uint8, BT.601, of even sides.

    Parameters
    ----------
    image, encoding
        As `H264Encoder.encode` takes them.

    Raises
    ------
    ImageFormatError
        If it is empty.
    """
    if not image.size:
        raise ImageFormatError(f'a picture of {image.shape[1]}x{image.shape[0]} px is empty')
    while _is_too_large(image):
        half = tuple(max(1, side // 2) for side in image.shape[1::-1])
        image = cv2.resize(image, half, interpolation=cv2.INTER_AREA)
    height, width = image.shape[:2]
    if height % 2 or width % 2:
        image = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    if encoding in _CONVERSIONS:
        return cv2.cvtColor(image, _CONVERSIONS[encoding])
    # As these do it: 16 to 235.
    luminance = cv2.convertScaleAbs(image, alpha=219 / 255, beta=16)
    colour = np.full((image.shape[0] // 2, image.shape[1]), 128, np.uint8)
    return np.vstack([luminance, colour])


def _is_too_large(image: np.ndarray) -> bool:
    rows, columns = (-(-side // _MACROBLOCK_PX) for side in image.shape[:2])
    return rows * columns > MAX_MACROBLOCKS or max(image.shape[:2]) > MAX_SIDE_PX
