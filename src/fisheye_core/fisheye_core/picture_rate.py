"""The rate that an encoder has to count with: it gives each picture its share of a second."""

from collections import deque

_PICTURES = 11
_LATEST = 5
"""After a change the rate is that of so many pictures."""
_FASTER, _SLOWER = 1.15, 0.6
_PAUSE_S = 1.0
"""After a pause, counting begins anew."""


class PictureRate:
    """A nominal rate that is left only when pictures come clearly faster or slower.

    Attributes
    ----------
    hz : float
        Pictures a second.
    """

    def __init__(self, hz: float):
        self.hz = hz
        self._times_s: deque[float] = deque(maxlen=_PICTURES)

    def changed(self, now_s: float) -> bool:
        """Count a picture; return whether the nominal rate is another one now."""
        times_s = self._times_s
        if times_s and not 0 < now_s - times_s[-1] < _PAUSE_S:
            times_s.clear()
        times_s.append(now_s)
        if len(times_s) < _PICTURES:
            return False
        hz = (_PICTURES - 1) / (now_s - times_s[0])
        if _SLOWER * self.hz < hz < _FASTER * self.hz:
            return False
        latest_hz = (_LATEST - 1) / (now_s - times_s[-_LATEST])
        self.hz = max(hz, latest_hz)
        times_s.clear()
        return True
