"""Cameras that went silent: their last picture stays, but nobody may take it for a live one."""

import cv2
import numpy as np

_BRIGHTNESS = 0.35
_TEXT_SHARE = 0.06
"""Height of the letters as a share of the panorama's height."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LETTER_PX = 22
"""Height of that font's letters at scale 1."""


def dimmed(image: np.ndarray) -> np.ndarray:
    """Give a darker copy of a picture."""
    return cv2.convertScaleAbs(image, alpha=_BRIGHTNESS)


def write_age(panorama: np.ndarray, columns: tuple[int, int], camera: str, age_s: float) -> None:
    """Write into the columns of a silent camera for how long there was no picture."""
    begin, end = columns
    lines = [camera, f'no picture for {age_s:.0f} s']
    scale = _TEXT_SHARE * panorama.shape[0] / _LETTER_PX
    sizes = [cv2.getTextSize(line, _FONT, scale, 1)[0] for line in lines]
    # Narrow columns get smaller letters.
    scale *= min(1.0, 0.9 * (end - begin) / max(width for width, _ in sizes))
    thickness = max(1, round(2 * scale))
    y = panorama.shape[0] // 2
    for line in lines:
        (width, height), _ = cv2.getTextSize(line, _FONT, scale, thickness)
        origin = (begin + (end - begin - width) // 2, y)
        for color, extra in ((0, 3 * thickness), (255, 0)):
            cv2.putText(
                panorama,
                line,
                origin,
                _FONT,
                scale,
                (color,) * 3,
                thickness + extra,
                cv2.LINE_AA,
            )
        y += 2 * height
