"""Fixtures of the tests of the pipeline, and of those of the launch file."""

import sys

import pytest
from launch_file import FILE, LaunchFile
from pipeline_line import LENS, SETTINGS, YAW, Line

from fisheye_capture.scene import Scene
from fisheye_geometry.attitude import Attitude


@pytest.fixture(scope='module')
def pictures():
    views = [Scene().view(LENS, Attitude(yaw_rad=yaw)) for yaw in (-YAW / 2, YAW / 2)]
    return dict(zip(('left', 'right'), (view.frame(0) for view in views), strict=True))


@pytest.fixture
def make_line():
    lines = []

    def make(settings=SETTINGS):
        lines.append(Line(settings))
        return lines[-1]

    yield make
    for line in lines:
        line.stop()


@pytest.fixture
def rig(monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'panorama_stitch', FILE.name])
    return LaunchFile(monkeypatch)
