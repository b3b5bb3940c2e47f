"""The clock of a free-running camera: stamps without their jitter, and when the next is due."""

from collections import deque
from collections.abc import Sequence
from itertools import accumulate, pairwise
from statistics import median
from typing import NamedTuple

_STAMPS = 32
"""Recent stamps that the clock is read from."""
_FEWEST = 4
"""Stamps that make a clock."""
_LONGEST_GAP = 8
"""Periods after which a camera counts as started anew."""
_OFF_BEAT = 0.75
"""Of the period: what is further off the beat is the frame of another one."""
_DOUBTFUL = 0.1
"""Of the period: with more jitter the beats may have been counted wrong."""
_RECENT = 9
"""Recent gaps whose median shows a changed rate."""
_OTHER_RATE = 1.5
"""Factor between the fitted and the usual gap from which the rate has changed."""


class FrameClock:
    """Fits a line through the recent stamps of a camera, lost frames left out.

    Attributes
    ----------
    last_ns : int or None
        The newest stamp; None before the first.
    jitter_ns : float
        Usual distance of the stamps from the line.
    """

    def __init__(self):
        self.last_ns: int | None = None
        self._stamps: deque[int] = deque(maxlen=_STAMPS)
        self._beats: deque[int] = deque(maxlen=_STAMPS)
        self._period_ns: float | None = None
        self._behind_ns = 0.0
        self.jitter_ns = 0.0

    def tick(self, stamp_ns: int) -> float:
        """Return the stamp of the next frame without its jitter, ns."""
        beats = self._beats_since_last(stamp_ns)
        if beats is None:
            self._stamps.clear()
            self._beats.clear()
            beats = 0
        self._beats.append(self._beats[-1] + beats if self._beats else 0)
        self._stamps.append(stamp_ns)
        self.last_ns = stamp_ns
        self._read()
        return self._smooth_ns

    def due_ns(self, when_ns: float) -> float | None:
        """Return when the frame is due that will lie nearest to a time, ns; None if unknown."""
        if self._period_ns is None:
            return None
        periods = max(1, round((when_ns - self._smooth_ns) / self._period_ns))
        return self._smooth_ns + periods * self._period_ns

    @property
    def _smooth_ns(self) -> float:
        return (self.last_ns or 0) + self._behind_ns

    def _beats_since_last(self, stamp_ns: int) -> int | None:
        """Count the periods since the last frame; None where the count starts anew."""
        if self.last_ns is None or stamp_ns <= self.last_ns:
            return None
        if self._period_ns is None:
            return 1
        periods = (stamp_ns - self._smooth_ns) / self._period_ns
        if periods > _LONGEST_GAP:
            return None
        # Jitter is more usual than a frame that was lost.
        usual = _OFF_BEAT + 2 * self.jitter_ns / self._period_ns
        return 1 if abs(periods - 1) < usual else max(0, round(periods))

    def _read(self) -> None:
        """Fit the line: the period, and where on it the newest stamp lies."""
        self._period_ns, self._behind_ns, self.jitter_ns = None, 0.0, 0.0
        if len(self._stamps) < _FEWEST:
            return
        # Relative to the newest, because nanoseconds since 1970 do not fit a float.
        times = [stamp - self._stamps[-1] for stamp in self._stamps]
        gaps = [later - former for former, later in pairwise(times)]
        line = _fit(self._beats, times)
        if line.jitter > _DOUBTFUL * line.period:
            usual = median(gaps)
            counted = accumulate((max(1, round(gap / usual)) for gap in gaps), initial=0)
            beats = deque(counted, maxlen=_STAMPS)
            other = _fit(beats, times)
            if other.jitter < _DOUBTFUL / 2 * other.period:
                self._beats, line = beats, other
        usual = median(gaps[-_RECENT:])
        if not usual / _OTHER_RATE < line.period < usual * _OTHER_RATE:
            self._stamps.clear()
            self._beats.clear()
            return
        self._period_ns, self._behind_ns, self.jitter_ns = line


class _Line(NamedTuple):
    """Stamps against beats: the slope, how far above the last stamp it ends, how far they lie."""

    period: float
    behind: float
    jitter: float


def _fit(beats: Sequence[int], times: Sequence[int]) -> _Line:
    """Fit a line by least squares."""
    mean_beat, mean_time = sum(beats) / len(times), sum(times) / len(times)
    apart = [beat - mean_beat for beat in beats]
    spread = sum(a * a for a in apart)
    period = sum(a * t for a, t in zip(apart, times, strict=True)) / max(spread, 1.0)
    # The median, so that frames counted on a wrong beat are no jitter.
    jitter = median(abs(t - mean_time - period * a) for a, t in zip(apart, times, strict=True))
    return _Line(period, mean_time + period * apart[-1], jitter)
