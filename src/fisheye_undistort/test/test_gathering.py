"""Pictures of which some are of no use, and targets that are not the one that was named."""

from dataclasses import replace

import numpy as np
import pytest
from foreign_lenses import foreign_lens
from rendered_view import Look, facing_pose, render_view, scattered_poses

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.gathering import gather
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.target.target import STANDARD, Target

LENS = foreign_lens('equisolid', 180)
BOARD = STANDARD['chessboard']
LEGACY = replace(STANDARD['charuco'], rows=6, legacy=True)
CIRCLES = Target('circles', 4, 5, 40.0, 32.0, radius_mm=11.0)
OTHER_MARKERS = replace(STANDARD['charuco'], dictionary='DICT_5X5_250')


def shots(target, count=3):
    poses = scattered_poses(LENS, target, count, (110, 170))
    return [
        NamedPicture(f'{i}.png', render_view(LENS, target, pose, seed=i))
        for i, pose in enumerate(poses)
    ]


@pytest.fixture(scope='module')
def boards():
    return shots(BOARD)


def test_foreign_and_unreadable_pictures_are_skipped_by_name(boards):
    portrait = NamedPicture('portrait.png', np.rot90(boards[0].gray).copy())
    broken = NamedPicture('broken.jpg', np.empty((0, 0), np.uint8), problem='broken.jpg is broken')
    collector = gather(lambda: [portrait, broken, *boards], Detector(BOARD)).collector
    assert len(collector.views) == 3
    assert collector.size == (640, 480)
    assert collector.skipped['broken.jpg'] == 'broken.jpg is broken'
    assert '480x640 px; most have 640x480' in collector.skipped['portrait.png']


def test_pictures_that_cannot_be_read_may_come_first(boards):
    broken = [
        NamedPicture(f'{i}.heic', np.empty((0, 0), np.uint8), problem=f'{i}.heic is broken')
        for i in range(10)
    ]
    collector = gather(lambda: [*broken, *boards], Detector(BOARD)).collector
    assert len(collector.views) == 3
    assert len(collector.skipped) == 10


def test_progress_is_told(boards):
    lines = []
    gather(lambda: boards, Detector(BOARD), lines.append)
    assert lines[-1] == '3 pictures, 3 views of the target'


def test_nothing_that_can_be_read():
    broken = NamedPicture('broken.jpg', np.empty((0, 0), np.uint8), problem='broken.jpg is broken')
    with pytest.raises(CalibrationError, match=r'no picture that can be read: broken\.jpg is'):
        gather(lambda: [broken], Detector(BOARD))


@pytest.mark.parametrize(
    ('shown', 'asked'),
    [
        pytest.param(BOARD, replace(BOARD, rows=7, columns=10), id='squares for corners'),
        pytest.param(CIRCLES, replace(CIRCLES, rows=5, columns=4), id='rows for columns'),
        pytest.param(LEGACY, replace(LEGACY, legacy=False), id='legacy layout'),
        pytest.param(OTHER_MARKERS, STANDARD['charuco'], id='other dictionary'),
        pytest.param(STANDARD['charuco'], replace(STANDARD['charuco'], rows=4, columns=6),
                     id='corners for squares'),
    ],
)  # fmt: skip
def test_another_target_of_the_same_numbers_is_taken_and_told(shown, asked):
    pictures = shots(shown, 2)
    gathered = gather(lambda: pictures, Detector(asked))
    assert len(gathered.collector.views) == 2
    # Of one family of markers, any dictionary that is large enough will do.
    assert replace(gathered.target, dictionary=shown.dictionary) == shown
    assert gathered.target.dictionary[:8] == shown.dictionary[:8]
    assert gathered.note == f'the pictures show {gathered.target}; {asked} was asked for'


@pytest.mark.parametrize('asked', ['circles', 'aprilgrid'])
def test_another_kind_of_target_is_named(asked, boards):
    with pytest.raises(CalibrationError, match='they show the target chessboard 6 x 9'):
        gather(lambda: boards[:1], Detector(STANDARD[asked]))


def test_a_chessboard_of_another_size_is_named(boards):
    with pytest.raises(CalibrationError, match='they show 6 x 9 inner corners of a chessboard'):
        gather(lambda: boards[:1], Detector(replace(BOARD, rows=12, columns=13)))


def test_an_empty_scene_stays_one():
    behind = render_view(LENS, BOARD, facing_pose(0.0, 3.0, 300), Look())
    gathered = gather(lambda: [NamedPicture('wall.png', behind)], Detector(BOARD))
    assert not gathered.collector.found_any
