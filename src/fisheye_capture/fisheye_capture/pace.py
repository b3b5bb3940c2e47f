"""Sources that could give pictures at any rate, and what paces them."""

import time
from abc import abstractmethod
from threading import Event

import numpy as np

from fisheye_capture.source import Frame, Source, SourceEndedError

_NS_PER_S = 1_000_000_000


class Pace:
    """Waits for times on a grid that is the same in every process: multiples of the period.

    Attributes
    ----------
    skipped
        Points of the grid that passed before they were asked for.
    """

    def __init__(self, rate_hz: float):
        self._period_ns = round(_NS_PER_S / rate_hz)
        self._last_ns: int | None = None
        self._interrupted = Event()
        self.skipped = 0

    def wait(self) -> int:
        """Sleep until the next point, or take the newest if more have passed; ns since the epoch.

        Raises
        ------
        SourceEndedError
            After `interrupt`.
        """
        now_ns = time.time_ns()
        newest_ns = now_ns // self._period_ns * self._period_ns
        # A last point that lies in the future shows that the clock was set back.
        last_ns = newest_ns if self._last_ns is None else min(self._last_ns, newest_ns)
        next_ns = last_ns + self._period_ns
        due_ns = max(next_ns, newest_ns)
        self.skipped += (due_ns - next_ns) // self._period_ns
        self._last_ns = due_ns
        if self._interrupted.wait(max(0.0, (due_ns - now_ns) / _NS_PER_S)):
            raise SourceEndedError('the source was closed')
        return due_ns

    def interrupt(self) -> None:
        """End a wait at once, and every later one."""
        self._interrupted.set()


class PacedSource(Source):
    """Frames on the common time grid, so that those of two cameras have equal stamps."""

    def __init__(self, rate_hz: float):
        self._pace = Pace(rate_hz)

    @property
    def skipped(self) -> int:  # type: ignore[override]  # counted by the pace
        """Frames that were due while the one before was still in work."""
        return self._pace.skipped

    def read(self) -> Frame:
        """Wait for the next point of the time grid that has a frame, and return it."""
        while True:
            stamp_ns = self._pace.wait()
            image = self._picture(stamp_ns)
            if image is not None:
                return Frame(stamp_ns, image)

    def interrupt(self) -> None:
        """End a wait at once."""
        self._pace.interrupt()

    @abstractmethod
    def _picture(self, stamp_ns: int) -> np.ndarray | None:
        """Return the picture of a time; None if it has none."""
