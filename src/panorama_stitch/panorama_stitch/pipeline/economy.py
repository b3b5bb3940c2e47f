"""Economy: what takes long is left out where the machine cannot keep the cameras' rate."""

from collections.abc import Callable
from threading import Lock
from time import monotonic

_BUSY, _IDLE = 0.8, 0.5
"""Shares of the time between frame sets: with more economy begins, with less it may end."""
_MOST_PER_FRAME = 2.0
"""A single frame set that takes longer is a hiccup, not a load."""
_SMOOTHING = 0.15
_SHORTEST_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 32.0
"""Economy lasts so long; twice as long each time that it has to begin again soon after."""
_PROVEN_S = 10.0
"""After so long without it, economy begins with the shortest pause again."""
_LONGEST_INTERVAL_S = 1.0


class Economy:
    """Watches how much of the time between frame sets goes into making panoramas.

    Attributes
    ----------
    is_on : bool
        Whether to leave out what takes long.
    load : float
        Share of the time that is spent, averaged over the last frame sets.
    """

    def __init__(self, clock: Callable[[], float] = monotonic):
        """Start; `clock` gives the time, s."""
        self.is_on = False
        self.load = 0.0
        self._clock = clock
        self._lock = Lock()
        self._interval_s = _LONGEST_INTERVAL_S
        self._arrived_s = self._changed_s = clock()
        self._started_s: float | None = None
        self._pause_s = _SHORTEST_PAUSE_S

    def arrived(self) -> None:
        """Note that a frame set came."""
        with self._lock:
            now = self._clock()
            interval_s = min(now - self._arrived_s, _LONGEST_INTERVAL_S)
            self._interval_s += _SMOOTHING * (interval_s - self._interval_s)
            self._arrived_s = now

    def started(self) -> bool:
        """Note that a panorama is begun; return whether economy is on."""
        self._started_s = self._clock()
        return self.is_on

    def ended(self) -> None:
        """Note that the panorama that was begun, if any, is published."""
        if self._started_s is None:
            return
        with self._lock:
            now = self._clock()
            spent = (now - self._started_s) / max(self._interval_s, 1e-6)
            self.load += _SMOOTHING * (min(spent, _MOST_PER_FRAME) - self.load)
            since_s = now - self._changed_s
            if not self.is_on and self.load > _BUSY:
                if since_s > _PROVEN_S:
                    self._pause_s = _SHORTEST_PAUSE_S
                self.is_on, self._changed_s = True, now
            elif self.is_on and self.load < _IDLE and since_s > self._pause_s:
                self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
                self.is_on, self._changed_s = False, now
            self._started_s = None
