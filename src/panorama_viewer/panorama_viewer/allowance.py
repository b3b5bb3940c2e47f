"""How much of something is allowed: a token bucket."""


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
