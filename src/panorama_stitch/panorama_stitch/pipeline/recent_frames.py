"""The frame sets on which an overlap is measured: a few of the last second."""

from collections import deque
from collections.abc import Callable, Sequence
from threading import Lock
from time import monotonic
from typing import NamedTuple

import numpy as np

_KEPT = 5
_APART_S = 0.2


class Remembered(NamedTuple):
    """Images of all cameras, and when the oldest of them was taken."""

    images: Sequence[np.ndarray]
    stamp_ns: int


class RecentFrames:
    """Keeps a few frame sets, some time apart; threads may share it."""

    def __init__(self, now_s: Callable[[], float] = monotonic):
        self._now_s = now_s
        self._kept: deque[Remembered] = deque(maxlen=_KEPT)
        self._newest_s = 0.0
        self._lock = Lock()

    def take(self, frames: Remembered) -> bool:
        """Keep a frame set if it is time for one; return whether it is the first."""
        now_s = self._now_s()
        with self._lock:
            is_first = not self._kept
            if is_first or now_s - self._newest_s >= _APART_S:
                self._newest_s = now_s
                self._kept.append(frames)
        return is_first

    @property
    def age_s(self) -> float:
        """How long ago the newest that is kept came, s."""
        return self._now_s() - self._newest_s

    def all(self) -> list[Remembered]:
        """Return what is kept, the oldest first."""
        with self._lock:
            return list(self._kept)

    def forget(self) -> None:
        """Keep none of them."""
        with self._lock:
            self._kept.clear()
