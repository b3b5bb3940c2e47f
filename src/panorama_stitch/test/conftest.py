"""Fixtures of the tests of the pipeline."""

import pytest
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
