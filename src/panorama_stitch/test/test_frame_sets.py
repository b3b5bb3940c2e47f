"""Frames of several cameras, and a machine that takes its time."""

from itertools import count

import numpy as np
import pytest

from fisheye_capture.synthetic import synthetic_lens
from panorama_stitch.pipeline import frame_sets as frame_sets_module
from panorama_stitch.pipeline import stale
from panorama_stitch.pipeline.frame_sets import FrameSets
from panorama_stitch.pipeline.known_cameras import KnownCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

LENS = synthetic_lens(64, 48, np.radians(170))
IMAGE = np.zeros((48, 64, 3), np.uint8)


def frame_sets():
    settings = PanoramaSettings()
    cameras = KnownCameras(settings.cameras)
    for camera in settings.cameras:
        cameras.place(camera, LENS, settings.surface_of(LENS))
    return FrameSets(settings, cameras)


def test_a_pause_while_a_frame_is_taken_ends_nothing(monkeypatch):
    frames = frame_sets()
    with monkeypatch.context() as patch:
        patch.setattr(stale, 'monotonic', count(step=1e6).__next__)
        assert not frames.take('left', 1, IMAGE, 'bgr8')
    assert frames.take('right', 1, IMAGE, 'bgr8'), 'it belongs to that frame'


class Hand:
    """Feeds frames at a rate, by a clock of its own."""

    def __init__(self, monkeypatch):
        self.now_s = 100.0
        for module in (stale, frame_sets_module):
            monkeypatch.setattr(module, 'monotonic', lambda: self.now_s)
        self.frames = frame_sets()
        self.stamps_ns, self.back_s = [], 0.0

    def feed(self, count, rates_hz, phase_s=0.02):
        """Return for each frame set whether a camera was stale, and how long none paired."""
        begin_s, told = self.now_s, []
        due = sorted(
            (begin_s + k / rate + index * phase_s, camera)
            for index, (camera, rate) in enumerate(rates_hz.items())
            for k in range(count)
        )
        for self.now_s, camera in due:
            unpaired_s = self.frames.unpaired_s
            if came := self.take(camera, self.now_s):
                told.append((bool(came.ages_s), unpaired_s))
        self.now_s = begin_s + count / max(rates_hz.values())
        return told

    def take(self, camera, stamp_s):
        """Return the frame set that a frame completes, if any."""
        if not self.frames.take(camera, round((stamp_s - self.back_s) * 1e9), IMAGE, 'bgr8'):
            return None
        came = self.frames.get()
        self.stamps_ns.append(came.stamp_ns)
        return came


@pytest.mark.parametrize(('rate_hz', 'phase_s'), [(0.2, 0.02), (1, 0.02), (1, 0.09), (1.9, 0.02)])
def test_a_slow_camera_that_lives_is_not_stale(monkeypatch, rate_hz, phase_s):
    told = Hand(monkeypatch).feed(12, dict.fromkeys(('left', 'right'), rate_hz), phase_s)
    # Its period shows with the second frame.
    assert told[-10:] == [(False, 0.0)] * 10


@pytest.mark.parametrize(('rate_hz', 'limit_s'), [(30, 0.5), (10, 0.5), (1, 2.5)])
def test_a_camera_that_dies_is_stale_after_the_limit_or_its_periods(monkeypatch, rate_hz, limit_s):
    hand = Hand(monkeypatch)
    hand.feed(12, {'left': rate_hz, 'right': rate_hz}, 0.0)
    last_s = hand.now_s - 1 / rate_hz
    hand.now_s = last_s + 0.99 * limit_s
    assert hand.frames.ages_s() == {}
    hand.now_s = last_s + 1.01 * limit_s
    assert list(hand.frames.ages_s()) == ['left', 'right']


def test_a_long_silence_is_no_period(monkeypatch):
    hand = Hand(monkeypatch)
    for _ in range(2):
        hand.feed(3, {'left': 30, 'right': 30}, 0.0)
        hand.now_s += 60.0
    assert list(hand.frames.ages_s()) == ['left', 'right']


@pytest.mark.parametrize('queued', [0, 1, 3])
@pytest.mark.parametrize('phase_s', [-0.012, 0.0, 0.012])
def test_nothing_is_shown_again_when_a_camera_comes_back(monkeypatch, phase_s, queued):
    hand, both = Hand(monkeypatch), {'left': 30, 'right': 30}
    hand.feed(12, both, phase_s)
    told = hand.feed(30, {'left': 30})
    assert told[-1] == (True, 0.0)
    for k in range(queued, 0, -1):  # what waited in a process that paused
        hand.take('right', hand.now_s + phase_s - k / 30)
    told = hand.feed(12, both, phase_s)
    assert told[-9:] == [(False, 0.0)] * 9
    assert hand.stamps_ns == sorted(set(hand.stamps_ns))


def test_clocks_that_jump_back_while_a_camera_is_stale_pair_again(monkeypatch):
    hand, both = Hand(monkeypatch), {'left': 30, 'right': 30}
    hand.feed(12, both)
    assert hand.feed(30, {'left': 30})[-1] == (True, 0.0)
    hand.stamps_ns.clear()
    hand.back_s = 3600.0
    assert hand.feed(12, both)[-9:] == [(False, 0.0)] * 9
    assert hand.stamps_ns[-9:] == sorted(set(hand.stamps_ns[-9:]))
