"""Frames of several cameras, and a machine that takes its time."""

from itertools import count

import numpy as np

from fisheye_capture.synthetic import synthetic_lens
from panorama_stitch.pipeline import stale
from panorama_stitch.pipeline.frame_sets import FrameSets
from panorama_stitch.pipeline.known_cameras import KnownCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

LENS = synthetic_lens(64, 48, np.radians(170))
IMAGE = np.zeros((48, 64, 3), np.uint8)


def test_a_pause_while_a_frame_is_taken_ends_nothing(monkeypatch):
    settings = PanoramaSettings()
    cameras = KnownCameras(settings.cameras)
    for camera in settings.cameras:
        cameras.place(camera, LENS, settings.surface_of(LENS))
    frames = FrameSets(settings, cameras)
    with monkeypatch.context() as patch:
        patch.setattr(stale, 'monotonic', count(step=1e6).__next__)
        assert not frames.take('left', 1, IMAGE, 'bgr8')
    assert frames.take('right', 1, IMAGE, 'bgr8'), 'it belongs to that frame'
