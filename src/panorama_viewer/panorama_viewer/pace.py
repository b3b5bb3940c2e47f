"""How much video a page gets: what its link takes, learnt from which pictures found it full.

A page takes no picture while the oldest one on its way is overdue. What it cannot take is left
out, so no picture waits anywhere. Where pictures are left out time and again because the link has
not delivered, the bit rate goes down, within a second; where none are it goes up, slowly, and more
slowly after each rise in vain. A page that is busy only gets fewer pictures.
"""

from collections import deque
from itertools import islice

NOMINAL_HZ = 30.0
"""Pictures a second that the encoder counts with."""
_LEAST_KBPS = 100.0
_PICTURE_KBIT, _LEAST_HZ = 25.0, 10.0
"""With less a picture is hardly worth having: the rate of pictures goes down instead, at first."""
_SLACK_S, _MOST_JITTER_S = 0.04, 0.1
"""What a picture may be late against the fastest one of the last seconds: so long, and what two in
turn differ by on average. Busy machines and repairs make them differ, queues do not."""
_AVERAGED = 16
_MEMORY_S = 10.0
_WINDOW_S, _WINDOWS = 0.25, 3
_BAD, _GOOD = 0.1, 0.05
"""Shares of pictures left out."""
_UNDER, _RISE = 0.95, 1.2
_LOWEST = 0.4
"""What is left of the bit rate at least: a single stall is no measure of a link."""
_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 60.0
"""Between two rises. Each begins with a keyframe."""
_IN_VAIN_S = 3.0


class PagePace:
    """Bounds the pictures on their way to one page. Times are of one steady clock, s.

    Attributes
    ----------
    kbps : float
        What the page may be sent in a second.
    """

    def __init__(self, most_kbps: float, now_s: float):
        self.kbps = most_kbps
        self._under_way: deque[tuple[float, int]] = deque()
        self._ways: deque[tuple[float, float]] = deque()
        self._windows: deque[tuple[int, int]] = deque(maxlen=_WINDOWS)
        self._offered = self._taken = 0
        self._jitter_s = 0.0
        self._window_s = self._due_s = now_s
        self._pause_s, self._rise_s, self._risen_s = _PAUSE_S, now_s + _PAUSE_S, -_IN_VAIN_S

    @property
    def rate_hz(self) -> float:
        """Pictures a second, at most."""
        return min(max(_LEAST_HZ, self.kbps / _PICTURE_KBIT), NOMINAL_HZ)

    @property
    def nominal_kbps(self) -> int:
        """Bit rate at which pictures that came `NOMINAL_HZ` times a second would be as large."""
        return round(self.kbps * NOMINAL_HZ / self.rate_hz)

    def takes(self, most_kbps: float, now_s: float, *, is_new: bool, unconfirmed: int = 0) -> bool:
        """Return whether a picture can be sent now.

        Parameters
        ----------
        most_kbps
            The limit.
        now_s
            The time.
        is_new
            Whether it is asked of this picture the first time.
        unconfirmed
            Bytes that the page's machine has not confirmed yet.
        """
        self.kbps = min(self.kbps, most_kbps)
        if now_s - self._window_s > _WINDOW_S:
            self._judge(most_kbps, now_s)
        if self.rate_hz < NOMINAL_HZ and now_s < self._due_s:
            return False
        is_full = self._is_full(now_s)
        after_oldest = sum(size for _, size in islice(self._under_way, 1, None))
        self._offered += is_new and (not is_full or unconfirmed > after_oldest)
        return not is_full

    def sent(self, now_s: float, size: int) -> None:
        """Note that a picture of so many bytes was sent."""
        self._under_way.append((now_s, size))
        self._taken += 1
        period_s = 1 / self.rate_hz
        self._due_s = max(self._due_s, now_s - period_s / 2) + period_s

    def drawn(self, now_s: float) -> None:
        """Note that the page has drawn the oldest picture on its way."""
        if self._under_way:
            way_s = now_s - self._under_way.popleft()[0]
            if self._ways:
                step_s = abs(way_s - self._ways[-1][1])
                self._jitter_s += (step_s - self._jitter_s) / _AVERAGED
            self._ways.append((now_s, way_s))
        while self._ways and now_s - self._ways[0][0] > _MEMORY_S:
            self._ways.popleft()

    def _is_full(self, now_s: float) -> bool:
        if not self._under_way:
            return False
        fastest_s = min((way_s for _, way_s in self._ways), default=0.0)
        late_s = _SLACK_S + min(self._jitter_s, _MOST_JITTER_S)
        return not fastest_s or now_s - self._under_way[0][0] > fastest_s + late_s

    def _judge(self, most_kbps: float, now_s: float) -> None:
        """Close a window of time, and change the bit rate if the last ones agree."""
        if self._offered:
            self._windows.append((self._offered, self._taken))
        self._offered = self._taken = 0
        self._window_s = now_s
        if len(self._windows) < _WINDOWS:
            return
        shares = [max(0.0, 1 - taken / offered) for offered, taken in self._windows]
        if min(shares) > 0 and sum(shares) > _WINDOWS * _BAD:
            left = 1 - (shares[-2] + shares[-1]) / 2
            self.kbps = max(_LEAST_KBPS, self.kbps * max(_LOWEST, left * _UNDER))
            is_in_vain = now_s - self._risen_s < _IN_VAIN_S
            self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S) if is_in_vain else _PAUSE_S
            self._settle(now_s)
        elif max(shares) > _GOOD:
            self._rise_s = max(self._rise_s, now_s + 1.0)
        elif now_s > self._rise_s and self.kbps < most_kbps:
            self.kbps = min(self.kbps * _RISE, most_kbps)
            self._risen_s = now_s
            self._settle(now_s)

    def _settle(self, now_s: float) -> None:
        self._rise_s = now_s + self._pause_s
        self._windows.clear()
