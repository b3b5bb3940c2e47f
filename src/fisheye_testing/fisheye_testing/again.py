"""Tests that ask for something in time: a machine with other work to do is asked again."""

import os
from functools import wraps

TRIES = 1 if os.environ.get('LONG') else 3
"""A fault that makes something slow is slow each time; the long form wants a quiet machine."""


class TooSlowError(AssertionError):
    """What had to happen did, but not in time."""


def asked_again(test):
    """Let a test that raises `TooSlowError` try again, from its start and with its fixtures."""

    @wraps(test)
    def ask(**given):
        for _ in range(TRIES - 1):
            try:
                return test(**given)
            except TooSlowError as error:
                print(f'\ntoo slow, asked again: {error}')
        return test(**given)

    return ask
