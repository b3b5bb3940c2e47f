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
    height, width = image.shape[:2]
    if count := halvings(width, height):
        height, width = (max(1, side >> count) for side in (height, width))
        image = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
    if height % 2 or width % 2:
        image = cv2.copyMakeBorder(image, 0, height % 2, 0, width % 2, cv2.BORDER_REPLICATE)
    if encoding in _CONVERSIONS:
        return cv2.cvtColor(image, _CONVERSIONS[encoding])
    # As these do it: 16 to 235.
    luminance = cv2.convertScaleAbs(image, alpha=219 / 255, beta=16)
    colour = np.full((image.shape[0] // 2, image.shape[1]), 128, np.uint8)
    return np.vstack([luminance, colour])


def halvings(width: int, height: int) -> int:
    """Return how often a picture of so many px is halved until level 5.1 takes it."""
    count = 0
    while _is_too_large(width >> count, height >> count):
        count += 1
    return count


def _is_too_large(width: int, height: int) -> bool:
    columns, rows = (-(-side // _MACROBLOCK_PX) for side in (width, height))
    return rows * columns > MAX_MACROBLOCKS or max(width, height) > MAX_SIDE_PX
