from dataclasses import replace

import cv2
import numpy as np
import pytest

from fisheye_core.errors import SettingError
from fisheye_undistort.target.marker_dictionary import dictionary_named
from fisheye_undistort.target.target import KINDS, MARKERS, STANDARD, Target


def test_every_kind_has_a_standard_sheet():
    assert tuple(STANDARD) == KINDS
    assert all(STANDARD[kind].kind == kind for kind in KINDS)


def test_the_papers_sheet():
    points = STANDARD['circles'].points_mm
    assert points.tolist() == [[x, y, 0] for y in (-70, 0, 70) for x in (-100, 0, 100)]


def test_every_other_row_of_acircles_is_moved():
    target = Target('acircles', 3, 2, 20, 20, radius_mm=8)
    x, y, _ = (target.points_mm - target.points_mm[0]).T
    assert x.tolist() == [0, 40, 20, 60, 0, 40]
    assert y.tolist() == [0, 0, 20, 20, 40, 40]


@pytest.mark.parametrize(('rows', 'columns'), [(3, 3), (3, 8), (6, 9), (7, 7)])
def test_dots_of_a_chessboard_are_a_white_square_and_its_neighbours(rows, columns):
    above, middle, right = Target('chessboard', rows, columns, 25, 25).dotted_squares
    row, column = middle
    assert (row + column) % 2 == 1
    assert (above, right) == ((row - 1, column), (row, column + 1))
    # With corners all around them, which the outermost squares have not.
    assert 1 < row < rows
    assert 0 < column < columns - 1


def test_a_charuco_board_has_inner_corners_only():
    assert len(STANDARD['charuco'].points_mm) == 4 * 6


def test_a_grid_of_tags_has_four_corners_each():
    target = STANDARD['aprilgrid']
    points = target.points_mm.reshape(12, 12, 3)
    assert np.allclose(np.diff(points[0, :, 0]), [22, 6.6] * 5 + [22])
    assert np.allclose(np.diff(points[:, 0, 1]), [22, 6.6] * 5 + [22])
    assert np.isclose(target.gap_mm, 6.6)


@pytest.mark.parametrize('dictionary', ['DICT_9X9_1', 'NO'])
def test_a_dictionary_that_opencv_does_not_know_is_refused(dictionary):
    with pytest.raises(SettingError, match=f"dictionary '{dictionary}' is not known; expected"):
        Target('charuco', 5, 7, 35.0, 35.0, marker_mm=26.0, dictionary=dictionary)


def test_points_are_centred():
    for target in STANDARD.values():
        extremes = np.array([target.points_mm.min(axis=0), target.points_mm.max(axis=0)])
        assert np.allclose(extremes.sum(axis=0), 0)


@pytest.mark.parametrize(
    ('arguments', 'told'),
    [
        (('stars', 3, 3, 10, 10, 3), "target 'stars'"),
        (('circles', 1, 3, 10, 10, 3), 'rows of the circles target is 1'),
        (('circles', 3, 101, 10, 10, 3), 'columns of the circles target is 101'),
        (('circles', 3, 3, 0, 10, 3), 'dx_mm is 0'),
        (('circles', 3, 3, float('nan'), 10, 3), 'dx_mm is nan'),
        (('circles', 3, 3, 10, 10, 5), 'radius_mm is 5; on this sheet expected more than 0 and 4'),
        (('chessboard', 6, 9, 25, 20), '25 x 20 mm'),
        (('charuco', 5, 7, 35, 35, 0, 35), 'marker_mm is 35'),
        (('charuco', 30, 30, 35, 35, 0, 20), 'more than the 250 markers'),
    ],
)
def test_impossible_targets_are_refused_by_name(arguments, told):
    with pytest.raises(SettingError) as error:
        Target(*arguments)
    assert told in str(error.value)


def test_an_opencv_without_markers_is_said_where_they_are_needed(monkeypatch):
    monkeypatch.delattr(cv2, 'aruco', raising=False)
    assert replace(STANDARD['charuco'], rows=4).rows == 4
    with pytest.raises(SettingError, match='the target has markers, and OpenCV'):
        dictionary_named(MARKERS)
