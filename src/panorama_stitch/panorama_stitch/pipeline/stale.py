"""Cameras that went silent: their last image stays, but nobody may take it for a live one."""

from collections import deque
from collections.abc import Sequence
from statistics import median_low
from time import monotonic

import cv2
import numpy as np

_PERIODS = 2.5
"""Of a camera, without a frame, before it can be stale."""
_GAPS = 9
"""Recent gaps between its frames of which the median is its period."""
_BRIGHTNESS = 0.35
_TEXT_SHARE = 0.06
"""Height of the letters as a share of the panorama's height."""
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_LETTER_PX = 22
"""Height of that font's letters at scale 1."""


class StaleCameras:
    """The last image of each camera, and which cameras gave none of late.

    Parameters
    ----------
    cameras
        Their names; each counts as alive from now on.
    """

    def __init__(self, cameras: Sequence[str]):
        self._images: dict[str, np.ndarray | None] = dict.fromkeys(cameras)
        self._arrived_s = dict.fromkeys(cameras, monotonic())
        self._gaps_s = {camera: deque[float](maxlen=_GAPS) for camera in cameras}
        self._periods_s = dict.fromkeys(cameras, 0.0)
        self._dimmed: dict[str, tuple[np.ndarray, np.ndarray]] = {}

    @property
    def missing(self) -> list[str]:
        """Cameras of which there is no image yet."""
        return [camera for camera, image in self._images.items() if image is None]

    def note(self, camera: str, image: np.ndarray) -> None:
        """Keep the newest image of a camera."""
        now_s = monotonic()
        if self._images[camera] is not None:
            self._gaps_s[camera].append(now_s - self._arrived_s[camera])
            self._periods_s[camera] = median_low(self._gaps_s[camera])
        self._images[camera] = image
        self._arrived_s[camera] = now_s

    def forget(self, camera: str) -> None:
        """Drop the image of a camera that is another one now; its age stays."""
        self._images[camera] = None

    def ages_s(self, limit_s: float) -> dict[str, float]:
        """Return the cameras that are stale at a limit, each with the age of its image, s."""
        now_s = monotonic()
        ages_s = {camera: now_s - arrived for camera, arrived in self._arrived_s.items()}
        return {
            camera: age for camera, age in ages_s.items() if age > self._limit_s(camera, limit_s)
        }

    def longest_limit_s(self, limit_s: float) -> float:
        """Return after how long without an image each camera would be stale, s."""
        return max(self._limit_s(camera, limit_s) for camera in self._periods_s)

    def _limit_s(self, camera: str, limit_s: float) -> float:
        return max(limit_s, _PERIODS * self._periods_s[camera])

    def last(self, camera: str) -> np.ndarray | None:
        """Return the last image of a camera; None if there is none."""
        return self._images[camera]

    def dim(self, camera: str, image: np.ndarray) -> np.ndarray:
        """Return a darker copy of a stale image, made once for all the time that it stays."""
        last, dark = self._dimmed.get(camera, (None, None))
        if last is not image or dark is None:
            dark = cv2.convertScaleAbs(image, alpha=_BRIGHTNESS)
            self._dimmed[camera] = image, dark
        return dark


def write_age(panorama: np.ndarray, columns: tuple[int, int], camera: str, age_s: float) -> None:
    """Write into the columns [begin, end) of a silent camera, if any, how old its image is."""
    begin, end = columns
    if begin == end:
        return
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
