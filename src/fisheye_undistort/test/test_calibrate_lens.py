import json
import re
import sys

import cv2
import numpy as np
import pytest

from fisheye_core.command_line import FAILED
from fisheye_geometry.camera_file import read_camera
from fisheye_undistort.calibrate_lens import GOOD, POOR, main

FOCAL = 0.003


@pytest.fixture(scope='module')
def shots(paper_pictures, tmp_path_factory):
    folder = tmp_path_factory.mktemp('shots')
    for number, picture in enumerate(paper_pictures):
        cv2.imwrite(str(folder / f'shot{number:02}.png'), picture)
    return folder


def refused(capsys, *arguments):
    """Run a command that must fail; give its sentence."""
    assert main([str(argument) for argument in arguments]) == FAILED
    told = capsys.readouterr().err
    assert told.startswith('calibrate_lens: ')
    assert told.count('\n') == 1
    return told


def test_a_good_calibration(shots, paper_lens, tmp_path, capsys):
    output, plot = tmp_path / 'left.yaml', tmp_path / 'report.png'
    arguments = [str(shots), '--name', 'left', '-o', str(output), '--plot', str(plot)]
    assert main(arguments) == GOOD
    camera = read_camera(output)
    assert camera.name == 'left'
    assert camera.lens.ros_model == 'equidistant'
    assert (camera.lens.width, camera.lens.height) == (640, 480)
    assert abs(camera.lens.focal_x_px / paper_lens.focal_x_px - 1) < FOCAL
    assert cv2.imread(str(plot)).shape[1] > 1000
    assert 'verdict  good' in capsys.readouterr().out


def test_how_far_it_is_calibrated_stands_in_the_file_and_beside_it(shots, tmp_path, capsys):
    output = tmp_path / 'left.yaml'
    assert main([str(shots), '--name', 'left', '-o', str(output)]) == GOOD
    report = json.loads((tmp_path / 'left.report.json').read_text())
    assert report['camera_name'] == 'left'
    assert report['good']
    assert 80 < report['calibrated_deg'] < 90
    first = output.read_text().splitlines()[0]
    assert first.startswith(f'# calibrated out to {report["calibrated_deg"]:.1f} degrees')
    assert (
        f'certain  to 0.5 degrees out to {report["calibrated_deg"]:.0f}' in capsys.readouterr().out
    )


def test_what_is_written_for_kalibr_is_converted_back_and_compared(shots, tmp_path, capsys):
    ours, chain, back = (tmp_path / name for name in ('ours.yaml', 'chain.yaml', 'back.yaml'))
    assert main([str(shots), '-o', str(ours)]) == GOOD
    assert main(['--convert', str(ours), '--to', 'kalibr', '-o', str(chain)]) == GOOD
    assert 'distortion_model: equidistant' in chain.read_text()
    assert main(['--convert', str(chain), '-o', str(back)]) == GOOD
    plot = tmp_path / 'difference.png'
    assert main(['--compare', str(ours), str(back), '--plot', str(plot)]) == GOOD
    assert 'difference up to 0.000 degrees' in capsys.readouterr().out
    assert cv2.imread(str(plot)).shape[1] > 500


def test_a_poor_one_is_written_all_the_same(shots, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main([str(shots / 'shot01.png'), '--name', 'rear']) == POOR
    assert read_camera(tmp_path / 'rear.yaml').name == 'rear'
    assert 'verdict  poor: only 1 view' in capsys.readouterr().out


def test_a_video(paper_pictures, tmp_path):
    path = tmp_path / 'wave.avi'
    video = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 10, (640, 480), False)
    for picture in paper_pictures:
        for _ in range(3):
            video.write(picture)
    video.release()
    assert main([str(path), '-o', str(tmp_path / 'camera.yaml')]) == GOOD


def test_half_of_a_side_by_side_picture(paper_pictures, tmp_path):
    for number, picture in enumerate(paper_pictures[:6]):
        both = np.hstack([np.zeros_like(picture), picture])
        cv2.imwrite(str(tmp_path / f'{number}.png'), both)
    output = tmp_path / 'right.yaml'
    assert main([str(tmp_path), '--half', 'right', '-o', str(output)]) in (GOOD, POOR)
    assert read_camera(output).lens.width == 640


@pytest.mark.parametrize('name', ['sheet.pdf', 'sheet.svg', 'sheet.png'])
def test_print_draws_the_sheet_and_nothing_else(name, tmp_path, capsys):
    assert main(['--print', str(tmp_path / name), '--target', 'charuco']) == GOOD
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert 'charuco 5 x 7' in capsys.readouterr().out


def test_no_target_anywhere(tmp_path, capsys):
    cv2.imwrite(str(tmp_path / 'wall.png'), np.full((480, 640), 180, np.uint8))
    assert 'none of 1 pictures' in refused(capsys, tmp_path)


def test_a_wrong_number_of_rows(shots, capsys):
    assert '3 x 3 (rows x columns), found; expected 4 rows' in refused(capsys, shots, '--rows', 4)


def test_an_unreadable_and_a_foreign_file_are_skipped_by_name(shots, tmp_path, capsys):
    (tmp_path / 'broken.jpg').write_bytes(b'broken')
    cv2.imwrite(str(tmp_path / 'small.png'), np.zeros((240, 320), np.uint8))
    output = str(tmp_path / 'camera.yaml')
    assert main([str(shots), str(tmp_path), '-o', output]) == GOOD
    told = capsys.readouterr().out
    assert re.search(r'broken\.jpg +not used: .*broken\.jpg is not a picture', told)
    assert re.search(r'small\.png +not used: has 320x240 px; most have 640x480 px', told)


def test_nothing_but_an_unreadable_file(tmp_path, capsys):
    (tmp_path / 'broken.jpg').write_bytes(b'broken')
    assert 'broken.jpg is not a picture' in refused(capsys, tmp_path / 'broken.jpg')


def test_all_views_alike(shots, tmp_path, capsys):
    picture = (shots / 'shot01.png').read_bytes()
    for number in range(4):
        (tmp_path / f'{number}.png').write_bytes(picture)
    assert 'all 4 views of the target are alike' in refused(capsys, tmp_path)


@pytest.mark.parametrize(
    ('arguments', 'told'),
    [
        ([], 'nothing to do'),
        (['--rows', 'many'], "argument --rows: invalid int value: 'many'"),
        (['x.png', '--target', 'stars'], "invalid choice: 'stars'"),
        (['x.png', '--radius-mm', '90'], 'radius_mm is 90'),
        (['--print', 'sheet.docx'], "'sheet.docx'"),
        (['nowhere.png'], 'nowhere.png is not there'),
        (['nowhere.png', '--seam-deg', '-1'], '--seam-deg is -1; expected 0 to 180 degrees'),
        (['--convert', 'nowhere.yaml'], 'nowhere.yaml cannot be read'),
        (['--compare', 'nowhere.yaml', 'x.yaml'], 'nowhere.yaml cannot be read'),
        (['x.png', '--target', 'charuco', '--dictionary', 'D'], "dictionary 'D' is not known"),
        (['nowhere.png', '--name', 'a/b'], "--name is 'a/b'; expected a word without '/'"),
    ],
)
def test_bad_arguments_are_a_sentence_too(arguments, told, capsys):
    assert told in refused(capsys, *arguments)


def test_the_file_cannot_be_written(shots, capsys):
    told = refused(capsys, shots / 'shot01.png', '-o', '/proc/nowhere/camera.yaml')
    assert '/proc/nowhere/camera.yaml cannot be written' in told


def test_without_ros_only_the_topic_is_refused(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, 'fisheye_undistort.collect_node', None)
    assert '--topic needs ROS 2' in refused(capsys, '--topic', '/left/image_raw')


@pytest.mark.parametrize('name', ['nowhere/plot.png', 'plot.docx', 'plot'])
def test_a_plot_that_cannot_be_is_refused_before_the_work_begins(name, tmp_path, capsys):
    told = refused(capsys, tmp_path / 'never read.png', '--plot', tmp_path / name)
    assert 'plot' in told
    assert 'cannot be written' in told


@pytest.mark.parametrize('work', [('never read.png',), ('--convert', 'never read.yaml')])
@pytest.mark.parametrize(
    ('name', 'reason'),
    [
        ('left.ini', 'expected a name with .yaml'),
        ('.', 'a folder'),
        ('file/a.yaml', 'Not a dir'),
    ],
)
def test_a_file_that_cannot_be_is_refused_before_the_work_begins(
    work, name, reason, tmp_path, capsys
):
    (tmp_path / 'file').touch()
    told = refused(capsys, *work, '-o', tmp_path / name)
    assert 'cannot be written' in told
    assert reason in told


def test_a_plot_that_fails_leaves_the_camera(shots, tmp_path, capsys):
    output, plot = tmp_path / 'camera.yaml', tmp_path / 'folder.png'
    plot.mkdir()
    told = refused(capsys, shots / 'shot01.png', '-o', output, '--plot', plot)
    assert 'folder.png cannot be written' in told
    assert read_camera(output).name == 'camera'
