"""A pytest plugin: no property-based test fails because the machine is busy."""

import pytest
from hypothesis import settings


def pytest_configure(config: pytest.Config) -> None:
    """Let examples take as long as they like."""
    settings.register_profile('unhurried', deadline=None)
    settings.load_profile('unhurried')
