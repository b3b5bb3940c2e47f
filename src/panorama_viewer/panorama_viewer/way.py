"""How long pictures take from the viewer to what a page has drawn."""

from collections import deque
from statistics import median

_TOLD_S = 2.0
"""What the time is told of."""
_ROUND_TRIPS = 20


class Way:
    """Times pictures by a page's answers, less the way of the answers. Times are s.

    A page answers a state at once: half of the shortest round trip is what an answer takes.
    """

    def __init__(self):
        self._told_s: deque[float] = deque()
        self._trips_s: deque[float] = deque(maxlen=_ROUND_TRIPS)
        self._drawn: deque[tuple[float, float]] = deque()

    def told(self, now_s: float) -> None:
        """Note that a state was sent."""
        self._told_s.append(now_s)

    def heard(self, now_s: float) -> None:
        """Note the answer to the oldest state that has none."""
        if self._told_s:
            self._trips_s.append(now_s - self._told_s.popleft())

    def drawn(self, now_s: float, came_s: float) -> None:
        """Note the answer to a picture that came to the viewer then."""
        self._drawn.append((now_s, now_s - came_s))

    def usual_s(self, now_s: float) -> float:
        """Return the median of the last seconds; 0 without any."""
        while self._drawn and now_s - self._drawn[0][0] > _TOLD_S:
            self._drawn.popleft()
        if not self._drawn:
            return 0.0
        back_s = min(self._trips_s, default=0.0) / 2
        return max(0.0, median(took_s for _, took_s in self._drawn) - back_s)
