"""Live pictures of a target that is not the one that was named."""

import time
from dataclasses import replace

import pytest
from rendered_view import facing_pose, render_view
from test_gathering import BOARD, LEGACY, LENS, shots

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.live_gathering import LiveGathering
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.target.target import STANDARD

PATIENCE_S = 60.0
"""Until another target is found in the background of a busy machine."""
WALL = render_view(LENS, BOARD, facing_pose(0.0, 3.0, 300))


def wave(gathering, pictures, until):
    """Show each picture for a while, over and over, until something is so."""
    end, number = time.monotonic() + PATIENCE_S, 0
    while not until():
        assert time.monotonic() < end
        gray = pictures[number // 3 % len(pictures)].gray
        gathering.add(NamedPicture(f'picture {number}', gray, moving=True))
        number += 1


@pytest.mark.parametrize(
    ('shown', 'asked', 'count'),
    [
        pytest.param(BOARD, replace(BOARD, rows=7, columns=10), 2, id='squares for corners'),
        pytest.param(LEGACY, replace(LEGACY, legacy=False), 5, id='legacy layout'),
    ],
)
def test_another_target_of_the_same_numbers_is_taken(shown, asked, count):
    gathering = LiveGathering(Detector(asked, quick=True))
    wave(
        gathering,
        shots(shown, count),
        lambda: gathering.target == shown and len(gathering.collector.views) == count,
    )
    gathered = gathering.gathered()
    assert gathered.target == shown
    assert gathered.note == f'the pictures show {shown}; {asked} was asked for'
    assert len(gathered.collector.finish()) == count


def test_another_kind_of_target_is_named():
    gathering = LiveGathering(Detector(STANDARD['circles'], quick=True))
    wave(gathering, shots(BOARD, 1), lambda: 'pictures show' in gathering.progress())
    assert gathering.progress().startswith('the pictures show the target chessboard 6 x 9')
    with pytest.raises(CalibrationError, match='they show the target chessboard 6 x 9'):
        gathering.gathered()


def test_the_sheet_may_come_late():
    gathering = LiveGathering(Detector(BOARD, quick=True))
    wall = NamedPicture('wall', WALL, moving=True)
    for _ in range(20):
        gathering.add(wall)
    wave(gathering, shots(BOARD, 2), lambda: len(gathering.collector.views) == 2)
    gathered = gathering.gathered()
    assert (gathered.target, gathered.note) == (BOARD, '')
