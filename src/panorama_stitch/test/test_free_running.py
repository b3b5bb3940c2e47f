"""Free-running cameras are paired at any rate, phase, jitter and drift."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fisheye_testing.free_running import CameraTiming, pair_frames
from panorama_stitch.pipeline.pairing import FramePairing

ENOUGH = 0.99
"""Of the slowest camera's frames; what is missing is where the figures begin and end."""
GAP = 2.0
"""Periods of the slowest camera."""
SHIFT = 1 / 1.6
"""Of the period: further apart, the other neighbour is clearly nearer."""
phases = st.floats(0.0, 1.0)


@given(st.floats(10.0, 60.0), phases, st.floats(0.0, 0.12), st.integers(0, 9))
def test_cameras_of_one_rate_lose_no_frame_at_any_phase(rate_hz, phase, jitter, seed):
    period_ms = 1000 / rate_hz
    cameras = [
        CameraTiming(rate_hz, 0.0, jitter * period_ms),
        CameraTiming(rate_hz, phase * period_ms, jitter * period_ms),
    ]
    paired = pair_frames(FramePairing, cameras, seconds=10.0, seed=seed)
    assert paired.share > ENOUGH
    assert paired.gap_periods < GAP
    assert paired.worst_skew_ms < (SHIFT + 3 * jitter) * period_ms + 1.0


@given(st.floats(10.0, 60.0), st.floats(0.3, 1.0), phases, st.floats(0.0, 0.1), st.integers(0, 9))
def test_the_slower_camera_sets_the_rate(rate_hz, slower, phase, jitter, seed):
    period_ms = 1000 / rate_hz
    cameras = [
        CameraTiming(rate_hz, 0.0, jitter * period_ms),
        CameraTiming(rate_hz * slower, phase * period_ms, jitter * period_ms),
    ]
    paired = pair_frames(FramePairing, cameras, seconds=10.0, seed=seed)
    assert paired.share > ENOUGH
    assert paired.gap_periods < GAP
    assert paired.worst_skew_ms < (SHIFT + 3 * jitter) * period_ms + 1.0


@given(st.lists(st.floats(20.0, 40.0), min_size=3, max_size=3), phases, phases, st.integers(0, 9))
def test_three_free_cameras_lose_no_frame(rates_hz, second, third, seed):
    cameras = [
        CameraTiming(rate, phase * 1000 / rate, 1.0)
        for rate, phase in zip(rates_hz, (0.0, second, third), strict=True)
    ]
    paired = pair_frames(FramePairing, cameras, seconds=10.0, seed=seed)
    assert paired.share > ENOUGH
    assert paired.gap_periods < GAP


@given(st.sampled_from([(30, 30), (30, 29.83), (30, 25)]), phases, st.integers(0, 9))
def test_frames_that_come_late_lose_nothing(rates_hz, phase, seed):
    first, second = rates_hz
    late_ms = 6 * 1000 / max(rates_hz)
    cameras = [
        CameraTiming(first, 0.0, 1.0),
        CameraTiming(second, phase * 33.0, 1.0, late_ms=late_ms),
    ]
    assert pair_frames(FramePairing, cameras, seconds=10.0, seed=seed).share > ENOUGH


@pytest.mark.parametrize('late_ms', [280, 1000, 2500])
@pytest.mark.parametrize('rates_hz', [(30, 30), (60, 60), (60, 30), (30, 25)])
def test_a_camera_that_comes_late_by_more_loses_no_more_than_its_lag(rates_hz, late_ms):
    first, second = rates_hz
    cameras = [CameraTiming(first, 0.0, 1.0), CameraTiming(second, 3.0, 1.0, late_ms=late_ms)]
    paired = pair_frames(FramePairing, cameras, seconds=10.0)
    assert len(paired.groups) > ENOUGH * second * (10.0 - late_ms / 1000) - 1
    assert paired.worst_skew_ms < SHIFT * 1000 / first + 2.0


@given(phases, st.floats(0.0, 0.1), st.integers(0, 99))
def test_a_lost_frame_costs_one_group(phase, lost, seed):
    cameras = [CameraTiming(30, 0.0, 1.0), CameraTiming(30, phase * 33.0, 1.0, lost)]
    paired = pair_frames(FramePairing, cameras, seed=seed)
    # Where the frame was lost just as the order of the cameras changed, it is two.
    assert paired.share > ENOUGH - lost
    assert paired.worst_skew_ms < 34.0 + 2.0
