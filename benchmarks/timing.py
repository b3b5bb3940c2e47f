"""Measuring times side by side, so that what else the machine does falls on all alike."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from random import Random

import numpy as np


@dataclass(frozen=True)
class Spread:
    """Median, and the tenth and ninetieth percentile."""

    median: float
    low: float
    high: float

    def __str__(self) -> str:
        return f'{self.median:.2f} ({self.low:.2f} to {self.high:.2f})'


def spread(values) -> Spread:
    """Return the spread of numbers."""
    low, median, high = (float(v) for v in np.percentile(values, (10, 50, 90)))
    return Spread(median, low, high)


def interleaved(functions: Mapping[str, Callable[[], object]], rounds: int) -> dict:
    """Call functions in turns; give the times of each, ms, as an array of `rounds` numbers.

    What runs before leaves more or less of the cache, so each round has another order.
    """
    times = {name: np.empty(rounds) for name in functions}
    order, random = list(functions.items()), Random(1)
    for function in functions.values():
        function()
    for i in range(rounds):
        random.shuffle(order)
        for name, function in order:
            begin = time.perf_counter()
            function()
            times[name][i] = (time.perf_counter() - begin) * 1e3
    return times
