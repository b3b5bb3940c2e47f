"""Pictures to encode: a scene that passes by, with the noise of a sensor."""

import cv2
import numpy as np

SIGMA = 2.0


def moving_pictures(count: int, width: int = 320, height: int = 180) -> list[np.ndarray]:
    """Return pictures (height, width, 3) of a random scene, each 3 px further on."""
    rng = np.random.default_rng(7)
    coarse = rng.integers(0, 255, (height // 8 + 1, width // 2, 3), np.uint8)
    scene = cv2.resize(coarse, (4 * width, height), interpolation=cv2.INTER_CUBIC)
    return [
        np.clip(
            scene[:, at : at + width] + rng.normal(0, SIGMA, (height, width, 3)), 0, 255
        ).astype(np.uint8)
        for at in (3 * number % (3 * width) for number in range(count))
    ]


def noise_pictures(count: int, width: int = 320, height: int = 180) -> list[np.ndarray]:
    """Return pictures in which nothing can be foreseen: the most that an encoder can be given."""
    rng = np.random.default_rng(8)
    return [rng.integers(0, 255, (height, width, 3), np.uint8) for _ in range(count)]
