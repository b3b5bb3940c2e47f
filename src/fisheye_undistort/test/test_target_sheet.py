import re
from xml.etree import ElementTree

import cv2
import numpy as np
import pytest

from fisheye_core.errors import FileAccessError, SettingError
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.target.target import KINDS, STANDARD, Target
from fisheye_undistort.target.target_sheet import paper_for, sheet_picture, write_sheet

PX_PER_MM = 6.0
PRINTED_MM = 0.02
"""What the raster of the picture leaves uncertain."""
POINT_MM = 25.4 / 72
FIRST_TAG = 0xD5D628584
"""Code of the first tag of the family 36h11 (Olson 2011, doi 10.1109/ICRA.2011.5979561)."""


@pytest.mark.parametrize('kind', KINDS)
def test_the_points_are_where_the_target_says(kind):
    target = STANDARD[kind]
    picture, origin = sheet_picture(target, PX_PER_MM)
    # A scan of a sheet shows larger circles than a camera does.
    view = Detector(target, 1000, 1e6)('sheet', picture)
    printed = (view.points_px - origin) / PX_PER_MM
    # Which corner is the first cannot be told where the pattern is symmetric.
    expected = target.points_mm[view.ids, :2]
    miss = min(np.abs(printed - sign * expected).max() for sign in (1, -1))
    assert miss < PRINTED_MM


@pytest.mark.parametrize('kind', KINDS)
def test_pdf_and_svg_have_the_size_of_the_paper(kind, tmp_path):
    target = STANDARD[kind]
    assert write_sheet(tmp_path / 'sheet.pdf', target) == 'A4'
    write_sheet(tmp_path / 'sheet.svg', target)
    _, size_mm = paper_for(target)
    box = re.search(rb'/MediaBox \[ ([^]]*) \]', (tmp_path / 'sheet.pdf').read_bytes())[1]
    assert np.allclose(np.array(box.split(), float)[2:] * POINT_MM, size_mm, atol=0.01)
    page = ElementTree.parse(tmp_path / 'sheet.svg').getroot()
    sides = [float(page.get(side).removesuffix('pt')) for side in ('width', 'height')]
    assert np.allclose(np.array(sides) * POINT_MM, size_mm, atol=0.01)


def test_the_ruler_has_100_mm():
    picture, origin = sheet_picture(STANDARD['circles'], PX_PER_MM)
    _, (width, _) = paper_for(STANDARD['circles'])
    ruler = round(origin[0] - (width + 14) / 2 * PX_PER_MM + 8 * PX_PER_MM)
    dark = np.flatnonzero(picture[:, ruler - 1 : ruler + 2].min(axis=1) < 128)
    runs = np.split(dark, np.flatnonzero(np.diff(dark) > 1) + 1)
    length = max(len(run) for run in runs) / PX_PER_MM
    assert abs(length - 100) < 0.5


def test_the_smallest_paper_is_taken():
    assert paper_for(Target('circles', 7, 10, 25, 25, radius_mm=9))[0] == 'A4'
    assert paper_for(Target('circles', 7, 10, 50, 50, radius_mm=9))[0] == 'A2'


@pytest.mark.parametrize(
    ('name', 'target', 'told'),
    [
        ('sheet.docx', STANDARD['circles'], "'sheet.docx'"),
        ('sheet', STANDARD['circles'], '.pdf, .svg, .png'),
        ('sheet.pdf', Target('circles', 20, 20, 100, 100, radius_mm=9), 'A0 is the largest'),
    ],
)
def test_what_cannot_be_printed_is_told(name, target, told, tmp_path):
    with pytest.raises(SettingError) as error:
        write_sheet(tmp_path / name, target)
    assert told in str(error.value)


def test_a_file_that_cannot_be_written_is_told(tmp_path):
    with pytest.raises(FileAccessError, match=r'sheet\.pdf cannot be written: No such file'):
        write_sheet(tmp_path / 'nowhere' / 'sheet.pdf', STANDARD['circles'])


def test_markers_are_those_of_opencv():
    target = STANDARD['charuco']
    picture, origin = sheet_picture(target, PX_PER_MM)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)
    if hasattr(cv2.aruco, 'ArucoDetector'):
        corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(picture)
    else:  # before OpenCV 4.7
        corners, ids, _ = cv2.aruco.detectMarkers(picture, dictionary)
    assert sorted(ids.ravel()) == list(range(17))
    first = corners[ids.ravel().tolist().index(0)].reshape(4, 2)
    side = np.linalg.norm(first[1] - first[0]) / PX_PER_MM
    assert abs(side - target.marker_mm) < 0.3
    assert np.all(first.mean(axis=0) < origin)


def test_the_first_tag_is_that_of_kalibr_at_the_bottom_left():
    """Drawn as kalibr_create_target_pdf does: its bits from the last to the first, two borders."""
    target = STANDARD['aprilgrid']
    picture, origin = sheet_picture(target, PX_PER_MM)
    bottom_left = target.points_mm.reshape(12, 12, 3)[10, 0, :2]
    middle_mm = (np.arange(10) + 0.5) * target.marker_mm / 10
    x, y = (origin[:, None] + (bottom_left[:, None] + middle_mm) * PX_PER_MM).round().astype(int)
    bits = np.array([int(bit) for bit in f'{FIRST_TAG:036b}']).reshape(6, 6)
    assert np.array_equal(picture[y[:, None], x] > 127, np.pad(bits, 2) == 1)
