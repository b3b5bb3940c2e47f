import json
from dataclasses import replace

import numpy as np
import pytest
from conftest import seen_exactly
from rendered_view import facing_pose, scattered_poses

from fisheye_core.errors import FileAccessError
from fisheye_geometry.camera_file import Camera, read_camera, write_camera
from fisheye_undistort.fit.angle_map import lit_part
from fisheye_undistort.fit.calibration import calibrate
from fisheye_undistort.fit.estimate import TargetView
from fisheye_undistort.report.calibrated_angle import calibrated_deg, report_path
from fisheye_undistort.report.report import CalibrationReport
from fisheye_undistort.report.report_file import calibrated_line, write_report
from fisheye_undistort.report.report_plot import plot_report
from fisheye_undistort.target.target import Target

BOARD = Target('chessboard', 7, 10, 25, 25)
SIZE = (640, 480)


def circle(lens, angle_deg):
    """Return the picture of a wall through a lens that lights a circle of this radius."""
    pixels = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), axis=-1)
    rays, seen = lens.unproject(pixels)
    lit = seen & (rays[..., 2] > np.cos(np.radians(angle_deg)))
    return np.where(lit, 200, 3).astype(np.uint8)


def report(lens, poses, noise_px=0.05):
    random = np.random.default_rng(0)
    views = []
    for number, pose in enumerate(poses):
        view = seen_exactly(lens, BOARD, pose, f'shot{number}.png')
        noise = random.normal(0, noise_px, view.points_px.shape)
        views.append(TargetView(view.name, view.points_px + noise, view.ids))
    bright = circle(lens, 85)
    calibration = calibrate(views, BOARD, SIZE, lit=lit_part(bright))
    return CalibrationReport(calibration, bright, {'blank.png': 'no chessboard'})


@pytest.fixture(scope='module')
def good(paper_lens):
    return report(paper_lens, scattered_poses(paper_lens, BOARD, 14, (60, 150)))


def test_many_views_all_over_are_good(good):
    assert good.good
    assert good.verdict.startswith('good: 14 views fit to 0.0')
    assert 'known to 0.5 degrees out to 8' in good.verdict
    assert abs(good.certainty.calibrated_deg - 85) < 3


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
            'where the lens may be off by',
        ),
        (
            [facing_pose(a / 9, 0.4, 300, (0.3, 0.2, a)) for a in range(6)],
            0.05,
            'left corner, where the lens may be off by',
        ),
        (
            [facing_pose(a, 0.6, 120, (0.3, 0.2, a)) for a in range(6)],
            1.5,
            'the points scatter by',
        ),
        (
            [facing_pose(a, 0.1, 500, (0.1, 0, a)) for a in range(6)],
            0.5,
            'corner, where the lens may be off by',
        ),
    ],
)
def test_what_is_doubtful_is_named(poses, noise_px, doubt, paper_lens):
    doubtful = report(paper_lens, poses, noise_px)
    assert not doubtful.good
    assert doubtful.verdict.startswith('poor: ')
    assert doubt in doubtful.verdict


def test_with_a_seam_only_what_it_needs_is_asked_for(paper_lens):
    narrow = report(paper_lens, [facing_pose(a, 0.3, 220, (0.3, 0.2, a)) for a in range(12)])
    known_deg = narrow.certainty.calibrated_deg
    assert not narrow.good
    assert 50 < known_deg < 83
    assert replace(narrow, seam_deg=known_deg - 10).good
    assert not replace(narrow, seam_deg=known_deg + 5).good


def test_what_turned_and_what_was_left_out_is_told(good):
    told = replace(
        good.calibration,
        turned=('a.png', 'b.png'),
        outlying=('c.png: row 2, column 3, 9.0 px off',),
    )
    text = str(CalibrationReport(told, good.brightest, {}))
    assert '2 of 14 pictures are turned by 180 degrees to the others' in text
    assert 'left out: c.png: row 2, column 3, 9.0 px off' in text


def test_programs_and_people_can_read_how_far_it_is_calibrated(good, tmp_path):
    path = tmp_path / 'left.yaml'
    write_report(report_path(path), good, 'left')
    assert (tmp_path / 'left.report.json').exists()
    facts = json.loads(report_path(path).read_text())
    assert facts['good']
    assert len(facts['views']) == 14
    assert np.shape(facts['covariance']) == (11, 11)
    lens = good.calibration.lens
    write_camera(path, Camera('left', lens))
    known_deg = calibrated_deg(path, read_camera(path).lens)
    assert abs(known_deg - good.certainty.calibrated_deg) < 0.01
    for change in ({'focal_x_px': 1.0}, {'width': 320}, {'distortion': (0.1,) * 4}):
        assert calibrated_deg(path, replace(lens, **change)) is None
    text = report_path(path).read_text()
    for key, wrong in (('width', '"wide"'), ('focal_x_px', '-1'), ('calibrated_deg', '"far"')):
        report_path(path).write_text(text.replace(f'"{key}": ', f'"{key}": {wrong}, "was": '))
        assert calibrated_deg(path, lens) is None
    assert f'out to {good.certainty.calibrated_deg:.1f} degrees' in calibrated_line(good)


@pytest.mark.parametrize('content', ['', '[]', '{"calibrated_deg": 80}', 'no JSON'])
def test_a_report_that_says_nothing_is_none(content, paper_lens, tmp_path):
    (tmp_path / 'left.report.json').write_text(content)
    assert calibrated_deg(tmp_path / 'left.yaml', paper_lens) is None
    assert calibrated_deg(tmp_path / 'right.yaml', paper_lens) is None


def test_what_was_assumed_is_told(paper_lens):
    one = report(paper_lens, [facing_pose(0, 0.1, 250, (0.4, 0.2, 0))])
    assert 'k4' in one.assumed
    assert 'focal length' not in one.assumed
    assert 'could only be assumed' in one.verdict


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
    text = str(CalibrationReport(dropped, good.brightest, {}))
    assert 'odd.png' in text
    assert 'rms 9.00 px' in text
