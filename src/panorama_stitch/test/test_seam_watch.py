"""The watch on the seams: it tells drift and quality of a rig that moves in its mount."""

from unittest.mock import Mock

import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import BugError
from fisheye_geometry.attitude import Attitude
from panorama_stitch.overlap.monitor import SeamState
from panorama_stitch.pipeline import seam_watch
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState
from panorama_stitch.pipeline.seam_watch import SeamWatch

LENS = synthetic_lens(640, 480, np.radians(170))
YAW = np.radians(140)
SETTINGS = PanoramaSettings()
DEADLINE_S = 20.0
CLOSE_DEG = 0.2


def seen(moved_deg=0.0):
    yaws = -YAW / 2, YAW / 2 + np.radians(moved_deg)
    return [Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0) for yaw in yaws]


@pytest.fixture
def rig():
    rig = RigState(('left', 'right'))
    for camera in rig.cameras:
        rig.place(camera, LENS, SETTINGS.surface_of(LENS))
    rig.overlaps = measure_overlaps(rig, [seen()], SETTINGS, 'particles')
    return rig


@pytest.fixture
def watch(rig):
    watch = SeamWatch(rig)
    yield watch
    watch.stop()


def looked(watch, rig, images):
    """Let the watch look once; return what it saw."""
    watch.take(images, rig.overlaps).result(DEADLINE_S)
    (state,) = watch.states().values()
    return state


def test_a_rig_that_stands_still_has_a_good_seam(rig, watch):
    state = looked(watch, rig, seen())
    assert state.quality > 0.7
    assert watch.complaints() == []
    assert watch.metrics()['quality'] == state.quality


def test_a_mount_that_moved_is_told_with_the_remedy(rig, watch):
    state = SeamState(0.0, 0.0, False)
    for _ in range(6):
        state = looked(watch, rig, seen(2.0))
    assert state.drift_deg == pytest.approx(2.0, abs=CLOSE_DEG)
    assert state.quality < 0.5
    assert watch.metrics()['left-right overlap drift deg'] == state.drift_deg


def test_a_bug_is_told_until_it_looks_again(rig, watch, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(seam_watch, 'OverlapView', Mock(side_effect=IndexError('out of range')))
        with pytest.raises(BugError):
            watch.take(seen(), rig.overlaps).result(DEADLINE_S)
        (complaint,) = watch.complaints()
        assert 'the overlaps are not watched: a bug, IndexError: out of range' in complaint
    looked(watch, rig, seen())
    assert watch.complaints() == []


def test_it_looks_once_a_second(rig, watch, monkeypatch):
    now_s = [100.0]
    monkeypatch.setattr(seam_watch, 'monotonic', lambda: now_s[0])
    assert watch.is_due
    watch.take(seen(), rig.overlaps).result(DEADLINE_S)
    now_s[0] += 0.9
    assert not watch.is_due
    now_s[0] += 0.2
    assert watch.is_due


def test_many_moments_sharpen_a_measurement_that_they_agree_with(rig, watch):
    (overlap,) = rig.overlaps
    looked(watch, rig, seen())
    (sharpened,) = watch.sharpened([overlap])
    apart = sharpened.attitude.yaw_rad - overlap.attitude.yaw_rad
    assert np.degrees(apart) == pytest.approx(0.0, abs=CLOSE_DEG)
