"""What diagnostics tell in numbers, and what they tell where a number would be nonsense."""

import pytest

from panorama_stitch.pipeline.metrics import latency_metrics


def test_percentiles_of_the_latency():
    assert latency_metrics([]) == {}
    told = latency_metrics(range(101))
    assert told == {'latency p50 ms': 50.0, 'latency p95 ms': 95.0, 'latency p99 ms': 99.0}


@pytest.mark.parametrize(
    ('latency_ms', 'words'),
    [(-37_000.0, '37 s ahead of'), (1.8e12, '1.8e+09 s behind'), (-3.0, '0.003 s ahead of')],
)
def test_clocks_that_differ_are_told_in_place_of_a_latency(latency_ms, words):
    told = latency_metrics([latency_ms] * 9)
    assert told == {'latency': f"not known: the stamps are {words} this machine's clock"}
