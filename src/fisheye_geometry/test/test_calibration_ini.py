"""INI files of calibrations, as camera_calibration writes them."""

import pytest

from fisheye_core.errors import CameraFileError
from fisheye_geometry.camera_file import read_camera
from fisheye_geometry.lens import make_lens

INI = """# oST version 5.0 parameters

[image]

width
640

height
480

[narrow]

camera matrix
600.5 0 319.5
0 600.25 239.5
0 0 1

distortion
-0.3 0.1 1e-03 0.002 -0.01

rectification
1 0 0
0 1 0
0 0 1

projection
600 0 319.5 0
0 600 239.5 0
0 0 1 0
"""


@pytest.mark.parametrize('name', ['ost.txt', 'narrow.ini'])
def test_an_ini_file(tmp_path, name):
    path = tmp_path / name
    path.write_text(INI)
    camera = read_camera(path)
    matrix = [600.5, 0, 319.5, 0, 600.25, 239.5, 0, 0, 1]
    assert camera.name == 'narrow'
    assert camera.lens == make_lens('plumb_bob', 640, 480, matrix, [-0.3, 0.1, 1e-3, 0.002, -0.01])
    assert camera.projection[:4] == (600, 0, 319.5, 0)
    path.write_text(INI.replace('-0.01\n', '-0.01 0.5 0.25 0.125\n'))
    assert read_camera(path).lens.ros_model == 'rational_polynomial'


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('-0.01\n', '\n', 'line 18: distortion has 4 numbers; in an INI file 5 mean plumb_bob'),
        ('640', 'wide 640', 'image_width is None; expected'),
        ('0 0 1\n\ndist', '0 0\n\ndist', 'line 13: camera_matrix has 8 numbers; expected 9'),
        ('600.25', '6OO', "line 15: '6OO' is not a number"),
        ('319.5 0\n', 'nan 0\n', 'holds nan; expected finite numbers'),
    ],
)
def test_an_ini_file_that_is_broken_is_refused_with_its_line(tmp_path, old, new, words):
    path = tmp_path / 'ost.txt'
    path.write_text(INI.replace(old, new, 1))
    with pytest.raises(CameraFileError, match=words):
        read_camera(path)
