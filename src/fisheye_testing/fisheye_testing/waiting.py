"""Waiting for a condition, with a deadline instead of sleeps of a length that is hoped for."""

import time
from collections.abc import Callable

PATIENCE_S = 20.0
"""Long enough for a busy machine; nothing waits for it that works."""
_POLL_S = 0.01


def wait_for(
    condition: Callable[[], object], timeout_s: float = PATIENCE_S, what: str = 'it'
) -> object:
    """Poll until a condition holds and return its value.

    Raises
    ------
    TimeoutError
        If it does not hold in time; the sentence says what was due.
    """
    deadline_s = time.monotonic() + timeout_s
    while not (value := condition()):
        if time.monotonic() > deadline_s:
            raise TimeoutError(f'{what} did not happen within {timeout_s:g} s')
        time.sleep(_POLL_S)
    return value
