"""Following what should not change but does: at once at first, then ever more rarely."""

from collections import deque
from time import monotonic

_AT_ONCE = 3
"""Changes that are followed at once: a driver may correct itself."""
_FIRST_PAUSE_S = 5.0
"""After these, doubled with each further change; time to measure the overlap on a busy machine."""
_REMEMBERED = 8
_FORGOTTEN_AFTER_S = 60.0


class Settling:
    """Decides whether a change is followed now, so that what follows from it gets its time."""

    def __init__(self) -> None:
        self._followed_s: deque[float] = deque(maxlen=_REMEMBERED)
        self._waits = False

    @property
    def pause_s(self) -> float:
        """How long after the last change that was followed the next one is, s."""
        now = monotonic()
        count = sum(now - then < _FORGOTTEN_AFTER_S for then in self._followed_s)
        return 0.0 if count < _AT_ONCE else _FIRST_PAUSE_S * 2.0 ** (count - _AT_ONCE)

    @property
    def waits(self) -> bool:
        """Whether a change came that was not followed yet."""
        return self._waits

    def follow(self) -> bool:
        """Whether to follow a change now; to be asked again each time that it comes."""
        now = monotonic()
        self._waits = bool(self._followed_s) and now - self._followed_s[-1] < self.pause_s
        if not self._waits:
            self._followed_s.append(now)
        return not self._waits

    def calm(self) -> None:
        """Note that what is in use came again."""
        self._waits = False
