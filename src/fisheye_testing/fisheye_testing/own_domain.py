"""A pytest plugin: nodes that a test makes in its own process meet no other ones."""

import os
from typing import IO

import pytest

from fisheye_testing.domains import locked_domain

_LOCK = pytest.StashKey[IO[str]]()


def pytest_configure(config: pytest.Config) -> None:
    """Keep a ROS domain for this process alone for as long as it runs."""
    domain, config.stash[_LOCK] = locked_domain()
    os.environ['ROS_DOMAIN_ID'] = str(domain)
