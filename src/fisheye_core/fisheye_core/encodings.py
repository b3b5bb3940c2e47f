"""The pixel encodings that the nodes work in, by the names that ROS gives them."""

from collections.abc import Sequence

import cv2
import numpy as np

CHANNELS = {'bgr8': 3, 'rgb8': 3, 'mono8': 1}
"""The encodings, each with its number of channels."""

_CHANGES = {
    ('rgb8', 'bgr8'): cv2.COLOR_RGB2BGR,
    ('bgr8', 'rgb8'): cv2.COLOR_BGR2RGB,
    ('mono8', 'bgr8'): cv2.COLOR_GRAY2BGR,
    ('mono8', 'rgb8'): cv2.COLOR_GRAY2RGB,
    ('bgr8', 'mono8'): cv2.COLOR_BGR2GRAY,
    ('rgb8', 'mono8'): cv2.COLOR_RGB2GRAY,
}


def converted(image: np.ndarray, encoding: str, wanted: str) -> np.ndarray:
    """Convert an image to another encoding.

    Parameters
    ----------
    image
        (height, width[, 3]) uint8.
    encoding, wanted
        That of the picture and the other one, both of `CHANNELS`.

    Returns
    -------
    ndarray
        (height, width, 3) or, as mono8, (height, width) uint8; `image` itself if it is in the
        wanted encoding.
    """
    if encoding == wanted:
        return image
    return cv2.cvtColor(image, _CHANGES[encoding, wanted])


def alike(images: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return pictures all in colour if any is, (height, width[, 3]) uint8 as they are otherwise.

    Colour may be in either order: grey has the same in both.
    """
    if all(image.ndim == images[0].ndim for image in images):
        return list(images)
    return [cv2.cvtColor(i, cv2.COLOR_GRAY2BGR) if i.ndim == 2 else i for i in images]


def from_opencv(image: np.ndarray, wanted: str) -> np.ndarray:
    """Convert OpenCV's grey or BGR image (height, width[, 3]) to an encoding."""
    return converted(image, 'mono8' if image.ndim == 2 else 'bgr8', wanted)


def to_opencv(image: np.ndarray, encoding: str) -> np.ndarray:
    """Convert an image in an encoding to what OpenCV takes: (height, width[, 3]) grey or BGR."""
    return converted(image, encoding, 'mono8' if encoding == 'mono8' else 'bgr8')
