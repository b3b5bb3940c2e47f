"""How often something happens."""

import time
from collections import deque

_TIMES = 60
"""Events over which a rate is measured."""


class RateMeter:
    """Counts events a second, of late."""

    def __init__(self) -> None:
        self._times_s: deque[float] = deque(maxlen=_TIMES)

    def count(self) -> None:
        """Note that it happened."""
        self._times_s.append(time.monotonic())

    @property
    def hz(self) -> float:
        """Events a second; sinks while there are none."""
        if len(self._times_s) < 2:
            return 0.0
        return (len(self._times_s) - 1) / (time.monotonic() - self._times_s[0])
