"""What the tests of this package share."""

from dataclasses import replace

import cv2
import numpy as np
import pytest

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_testing.waiting import wait_for


@pytest.fixture
def wait_until():
    """Wait until a condition holds; fail when that takes too long."""
    return lambda condition, what: wait_for(condition, what=what)


@pytest.fixture
def settings():
    """Make the settings of a camera called left."""

    def make(source='synthetic', **changes):
        fast = {'frame_rate_hz': 200.0, 'source': str(source)}
        return replace(CaptureSettings(), **{**fast, **changes}).named('left')

    return make


@pytest.fixture
def write_picture(tmp_path):
    """Write a plain picture of a level of grey; give its path."""

    def write(name, level, width=32, height=24):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        cv2.imwrite(str(path), np.full((height, width, 3), level, np.uint8))
        return path

    return write


@pytest.fixture
def video(tmp_path):
    path = tmp_path / 'video.avi'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 25, (32, 24))
    for level in (50, 100, 150):
        writer.write(np.full((24, 32, 3), level, np.uint8))
    writer.release()
    return path
