"""Pictures as a robot sees them that turns: what is in one picture passes by, with noise."""

from collections.abc import Iterator

import cv2
import numpy as np

TURN_DEG_S = 20.0
NOISE = 2.0
"""Of the sensor, grey levels."""
_NOISES = 7


def turning(image: np.ndarray, width_deg: float, rate_hz: float, count: int) -> Iterator:
    """Yield pictures (height, width, 3) at a rate, each a little further to the right.

    Parameters
    ----------
    image
        What is seen at first, (height, width, 3) uint8; beyond its edges it goes on mirrored.
    width_deg
        The angle across it.
    rate_hz, count
        Of the pictures.
    """
    height, width = image.shape[:2]
    world = np.hstack([image, image[:, ::-1], image, image[:, ::-1]])
    rng = np.random.default_rng(4)
    noises = [rng.normal(0, NOISE, image.shape).round().astype(np.int16) for _ in range(_NOISES)]
    step_px = width / width_deg * TURN_DEG_S / rate_hz
    for number in range(count):
        whole, part = divmod(number * step_px % (2 * width), 1)
        shift = np.float32([[1, 0, -part], [0, 1, 0]])
        seen = cv2.warpAffine(
            world[:, int(whole) : int(whole) + width + 1], shift, (width, height)
        )
        yield np.clip(seen + noises[number % _NOISES], 0, 255).astype(np.uint8)
