"""What the measured numbers have to reach."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Requirement:
    """A number and its limit, the most that it may be or the least."""

    what: str
    measured: float
    limit: float
    is_least: bool = False

    @property
    def excess(self) -> float:
        """How far it is from its limit; up to 1 it is met."""
        if self.is_least:
            return self.limit / max(self.measured, 1e-9)
        return self.measured / self.limit if self.limit else 1.0 + self.measured

    def __str__(self) -> str:
        verdict = 'met' if self.excess <= 1 else 'MISSED'
        word = 'at least' if self.is_least else 'at most'
        return f'{verdict:6s} {self.what}: {self.measured:.3g}, {word} {self.limit:g}'
