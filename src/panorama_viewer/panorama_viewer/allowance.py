"""How much of something is allowed: a token bucket, or one for each source."""

from collections import OrderedDict

_MAX_SOURCES = 1000


class Allowance:
    """Allows `burst` at once and `per_s` a second in the long run.

    Times are those of one steady clock, s.
    """

    def __init__(self, burst: float, per_s: float, now_s: float):
        self._burst, self._per_s = burst, per_s
        self._left, self._seen_s = burst, now_s

    def take(self, amount: float, now_s: float) -> bool:
        """Spend an amount; return whether so much was left."""
        refill = (now_s - self._seen_s) * self._per_s
        self._left, self._seen_s = min(self._burst, self._left + refill), now_s
        if amount > self._left:
            return False
        self._left -= amount
        return True


class Allowances:
    """The same for each source, of which the last thousand are remembered."""

    def __init__(self, burst: float, per_s: float):
        self._burst, self._per_s = burst, per_s
        self._of: OrderedDict[str, Allowance] = OrderedDict()

    def take(self, source: str, now_s: float) -> bool:
        """Spend one of a source's; return whether it was left."""
        allowance = self._of.pop(source, None) or Allowance(self._burst, self._per_s, now_s)
        if len(self._of) >= _MAX_SOURCES:
            self._of.popitem(last=False)
        self._of[source] = allowance
        return allowance.take(1, now_s)
