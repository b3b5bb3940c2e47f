"""How often something happens."""

import pytest

from fisheye_core import rate_meter as rate_module
from fisheye_core.rate_meter import RateMeter


def test_it_counts_events_a_second_and_sinks_without_them(monkeypatch):
    now_s = [0.0]
    monkeypatch.setattr(rate_module.time, 'monotonic', lambda: now_s[0])
    rate = RateMeter()
    assert rate.hz == 0
    for _ in range(100):
        now_s[0] += 0.1
        rate.count()
    assert rate.hz == pytest.approx(10)
    now_s[0] += 60
    assert rate.hz < 1
