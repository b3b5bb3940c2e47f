"""The rate that an encoder has to count with: it gives each picture its share of a second."""

from collections import deque

_PICTURES, _FEW = 11, 5
_FASTER, _SLOWER = 1.15, 0.6
_MUCH_FASTER = 1.6
"""Of few pictures: a jump is followed before much was sent at the old share."""
_PAUSE_S, _PAUSE_PERIODS = 1.0, 3
"""What is longer than both is a pause, after which counting begins anew."""
_LONGEST_PERIOD_S = 10.0
"""Of the slowest cameras."""


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
        """Count a picture that comes at a time; return whether the nominal rate is now another."""
        times_s = self._times_s
        period_s = _LONGEST_PERIOD_S  # the first may be any
        if len(times_s) > 1:
            period_s = min(period_s, times_s[-1] - times_s[-2])
        if times_s and not 0 < now_s - times_s[-1] < max(_PAUSE_S, _PAUSE_PERIODS * period_s):
            times_s.clear()
        times_s.append(now_s)
        if len(times_s) < _FEW:
            return False
        few_hz = (_FEW - 1) / (now_s - times_s[-_FEW])
        hz = (len(times_s) - 1) / (now_s - times_s[0])
        is_known = len(times_s) == _PICTURES
        is_faster = few_hz > _MUCH_FASTER * self.hz or (is_known and hz > _FASTER * self.hz)
        if not is_faster and not (is_known and hz < _SLOWER * self.hz):
            return False
        self.hz = max(hz, few_hz)
        times_s.clear()
        return True
