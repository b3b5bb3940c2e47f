from dataclasses import replace

import numpy as np
import pytest
from conftest import seen_exactly
from rendered_view import facing_pose, scattered_poses

from fisheye_core.errors import FileAccessError
from fisheye_undistort.calibration import calibrate
from fisheye_undistort.estimate import TargetView
from fisheye_undistort.report import CalibrationReport
from fisheye_undistort.report_plot import plot_report
from fisheye_undistort.target import Target

BOARD = Target('chessboard', 7, 10, 25, 25)
SIZE = (640, 480)
BRIGHT = np.full(SIZE[::-1], 200, np.uint8)


def report(lens, poses, noise_px=0.05):
    random = np.random.default_rng(0)
    views = []
    for number, pose in enumerate(poses):
        view = seen_exactly(lens, BOARD, pose, f'shot{number}.png')
        noise = random.normal(0, noise_px, view.points_px.shape)
        views.append(TargetView(view.name, view.points_px + noise, view.ids))
    return CalibrationReport(calibrate(views, BOARD, SIZE), BRIGHT, {'blank.png': 'no chessboard'})


@pytest.fixture(scope='module')
def good(paper_lens):
    return report(paper_lens, scattered_poses(paper_lens, BOARD, 14, (90, 200)))


def test_many_views_all_over_are_good(good):
    assert good.good
    assert good.verdict.startswith('good: 14 views out to')


def test_everything_is_told(good):
    text = str(good)
    for told in (
        'shot3.png',
        'blank.png',
        'not used: no chessboard',
        'focal_x_px',
        '+-',
        '10-20 deg',
        'verdict  good',
    ):
        assert told in text


def test_coverage_counts_every_point(good):
    assert good.coverage.sum() == 14 * 70
    assert abs(np.degrees(good.edge_rad) - 85) < 1


@pytest.mark.parametrize(
    ('poses', 'noise_px', 'doubt'),
    [
        ([facing_pose(0, 0.1, 150, (0.4, 0.2, 0))], 0.05, 'only 1 view '),
        (
            [facing_pose(a, 0.2, 250, (0.4, 0.2, a)) for a in range(6)],
            0.05,
            'degrees, and the picture shows 8',
        ),
        ([facing_pose(a / 9, 0.6, 120, (0.3, 0.2, a)) for a in range(6)], 0.05, 'of 8 directions'),
        (
            [facing_pose(a, 0.6, 120, (0.3, 0.2, a)) for a in range(6)],
            1.5,
            'the points scatter by',
        ),
        (
            [facing_pose(a, 0.1, 500, (0.1, 0, a)) for a in range(6)],
            0.5,
            'focal length is uncertain',
        ),
    ],
)
def test_what_is_doubtful_is_named(poses, noise_px, doubt, paper_lens):
    doubtful = report(paper_lens, poses, noise_px)
    assert not doubtful.good
    assert doubtful.verdict.startswith('poor: ')
    assert doubt in doubtful.verdict


def test_what_was_assumed_is_told(paper_lens):
    one = report(paper_lens, [facing_pose(0, 0.1, 150, (0.4, 0.2, 0))])
    assert 'assumed' in str(one)


def test_the_plot_is_drawn(good, tmp_path):
    example = np.zeros(SIZE[::-1], np.uint8)
    plot_report(tmp_path / 'report.png', good, example)
    assert (tmp_path / 'report.png').stat().st_size > 50_000
    with pytest.raises(FileAccessError, match='cannot be written'):
        plot_report(tmp_path / 'nowhere' / 'report.png', good, example)
    with pytest.raises(FileAccessError, match=r'report\.docx'):
        plot_report(tmp_path / 'report.docx', good, example)


def test_dropped_views_are_told(good):
    dropped = replace(good.calibration, dropped={'odd.png': 'does not fit: rms 9.00 px'})
    text = str(CalibrationReport(dropped, BRIGHT, {}))
    assert 'odd.png' in text
    assert 'rms 9.00 px' in text
