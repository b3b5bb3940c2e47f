"""What the tests of this package share."""

import time
from collections.abc import Callable
from dataclasses import replace

import pytest

from fisheye_capture.settings import CaptureSettings

PATIENCE_S = 20.0
"""Long enough for a busy machine; a test that works does not wait for it."""


def wait_until(condition: Callable[[], object], what: str) -> None:
    """Wait until a condition holds; fail when it takes too long."""
    deadline_s = time.monotonic() + PATIENCE_S
    while not condition():
        if time.monotonic() > deadline_s:
            pytest.fail(f'{what} did not happen within {PATIENCE_S:g} s')
        time.sleep(0.005)


@pytest.fixture
def settings():
    """Make settings of a camera called left."""

    def make(**changes) -> CaptureSettings:
        return replace(CaptureSettings(), **changes).named('left')

    return make
