"""Real pictures: where they are, and what a test does without them."""

import os
from pathlib import Path

import pytest

DATA = Path(os.environ.get('FISHEYE_DATA', ''))


def real_data(*parts: str) -> Path:
    """Return a file or folder of real pictures; without it the test is skipped, or fails.

    It fails where the environment has REQUIRE_DATA=1.
    """
    path = DATA.joinpath(*parts)
    if not path.exists():
        message = f'{path} is not there: real pictures are looked for in $FISHEYE_DATA'
        if os.environ.get('REQUIRE_DATA') == '1':
            pytest.fail(message)
        pytest.skip(message)
    return path
