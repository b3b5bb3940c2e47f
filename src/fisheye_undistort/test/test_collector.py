import tracemalloc

import numpy as np
import pytest

from fisheye_core.errors import CalibrationError, ImageFormatError
from fisheye_undistort.detect.collector import Collector
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.target.target import STANDARD

GRID = np.stack(np.meshgrid(np.arange(3), np.arange(3)), axis=-1).reshape(-1, 2) * 40.0
SIZE = (640, 480)


@pytest.fixture
def collector():
    """Return a collector whose detector reads the place of the target from two pixels."""

    def detect(name, gray):
        x, y = gray[0, :2].astype(float) * 2
        if x == 0:
            raise CalibrationError('nothing there')
        return TargetView(name, GRID + np.array([x, y]), np.arange(9))

    detect.target = STANDARD['circles']
    return Collector(detect)


def shot(name, x=0, y=0, moving=False, size=SIZE):
    gray = np.zeros(size[::-1], np.uint8)
    gray[0, :2] = x // 2, y // 2
    return NamedPicture(name, gray, moving)


def test_new_places_are_kept(collector):
    assert collector.add(shot('a', 100, 100))
    assert collector.add(shot('b', 200, 100))
    assert [view.name for view in collector.finish()] == ['a', 'b']
    assert collector.size == SIZE


def test_the_same_place_is_not_kept_twice(collector):
    collector.add(shot('a', 100, 100))
    assert not collector.add(shot('b', 102, 100))
    assert collector.skipped == {'b': 'shows the target where a does'}


def test_a_moving_target_must_rest(collector):
    assert not collector.add(shot('1', 100, 100, moving=True))
    assert collector.state == 'the target moves'
    assert not collector.add(shot('2', 140, 100, moving=True))
    assert collector.add(shot('3', 142, 100, moving=True))
    assert not collector.add(shot('4', 142, 100, moving=True))
    assert collector.skipped == {}


@pytest.mark.parametrize('kind', ['charuco', 'aprilgrid'])
def test_points_that_come_and_go_do_not_move_a_sheet_with_markers(kind):
    target = STANDARD[kind]
    points = target.points_mm[:, :2] * 1.6 + (320, 240)
    collector = Collector(Detector(target))

    def look(first, shift=0):
        ids = np.arange(first, len(points))
        name = f'{first} {shift}'
        return collector.add(shot(name, moving=True), TargetView(name, points[ids] + shift, ids))

    assert [look(first) for first in (0, 4, 0, 8, 4)] == [False, True, False, False, False]
    assert collector.state == 'shows the target where 4 0 does'
    assert not look(0, 30)
    assert collector.state == 'the target moves'
    assert look(8, 30)


def test_progress_tells_views_and_coverage(collector):
    assert collector.progress() == 'no view of the target yet'
    collector.add(shot('a', 100, 100))
    before = collector.progress()
    collector.add(shot('b', 400, 300))
    assert before.startswith('1 views')
    assert collector.progress().startswith('2 views')
    shares = [int(line.split('%')[0].split()[-1]) for line in (before, collector.progress())]
    assert shares[1] > shares[0]


def test_sizes_must_agree(collector):
    collector.add(shot('a', 100, 100))
    with pytest.raises(ImageFormatError, match=r'b has 320x240 px.*640x480'):
        collector.add(shot('b', 100, 100, size=(320, 240)))


def test_no_target_anywhere(collector):
    for name in 'abc':
        collector.add(shot(name))
    with pytest.raises(CalibrationError, match='none of 3 pictures; the last: nothing there'):
        collector.finish()


def test_no_picture_at_all(collector):
    with pytest.raises(CalibrationError, match='none of 0 pictures'):
        collector.finish()


def test_all_views_alike(collector):
    for name in 'abc':
        collector.add(shot(name, 100, 100))
    with pytest.raises(CalibrationError, match='all 3 views of the target are alike'):
        collector.finish()


def test_a_target_that_never_rests(collector):
    for number in range(4):
        collector.add(shot(str(number), 100 + 50 * number, 100, moving=True))
    with pytest.raises(CalibrationError, match='moves in all 4 pictures'):
        collector.finish()


def test_the_brightest_and_an_example_are_remembered(collector):
    collector.add(shot('a', 100, 100))
    other = shot('b', 300, 200)
    other.gray[5, 5] = 250
    collector.add(other)
    assert collector.brightest[5, 5] == 250
    assert collector.brightest[0, 0] == 150
    assert collector.example.shape == SIZE[::-1]


def test_progress_costs_no_more_with_more_views(collector):
    def peak_bytes():
        tracemalloc.start()
        collector.progress()
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return peak

    first = shot('first', 30, 30)
    first.gray[1:] = 200
    collector.add(first)
    before = peak_bytes()
    for number in range(1, 40):
        collector.add(shot(str(number), 30 + 12 * number, 100))
    assert len(collector.views) == 40
    assert peak_bytes() < 2 * before


def test_where_to_show_it_next_is_told_where_the_lens_sees_anything(collector):
    first = shot('a', 300, 180)
    first.gray[:, :320] = 0
    first.gray[:, 320:] = 200
    first.gray[0, :2] = 150, 90
    collector.add(first)
    assert 'show it at the ' in collector.progress()
    assert 'left' not in collector.progress()
    second = shot('b', 400, 300)
    second.gray[1:] = 200
    collector.add(second)
    assert 'left' in collector.progress()
