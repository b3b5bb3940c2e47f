"""camera_info YAML: read, written, and refused with precise sentences."""

import pytest
import yaml

from fisheye_core.errors import CameraFileError, FileAccessError
from fisheye_geometry.camera_file import Camera, read_camera, write_camera
from fisheye_geometry.lens import make_lens

CAMERA = Camera(
    'left',
    make_lens('equidistant', 640, 480, [223, 0, 319.5, 0, 224, 239.5, 0, 0, 1], [0.1, 0.2, 0, 0]),
)


@pytest.mark.parametrize('model', ['equidistant', 'plumb_bob', 'rational_polynomial'])
def test_what_is_written_is_read(tmp_path, model):
    distortion = [0.1, 0.01, 0.001, 0.002, 0.0, 0.1, 0.2, 0.3]
    count = 8 if model == 'rational_polynomial' else 4
    lens = make_lens(model, 640, 480, [223, 0, 319.5, 0, 224, 239.5, 0, 0, 1], distortion[:count])
    camera = Camera('left', lens, projection=tuple(map(float, range(12))))
    write_camera(tmp_path / 'a' / 'camera.yaml', camera)
    assert read_camera(tmp_path / 'a' / 'camera.yaml') == camera
    assert [path.name for path in (tmp_path / 'a').iterdir()] == ['camera.yaml']


def test_the_synonym_fisheye_is_written_by_its_ros_name(tmp_path):
    lens = make_lens('fisheye', 640, 480, CAMERA.lens.matrix, [0, 0, 0, 0])
    write_camera(tmp_path / 'camera.yaml', Camera('', lens))
    assert 'distortion_model: equidistant' in (tmp_path / 'camera.yaml').read_text()


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'image_width': 'wide'}, "image_width is 'wide'; expected a whole number"),
        ({'image_width': None}, 'image_width is None; expected'),
        ({'image_height': 10**9}, 'height is 1000000000 px; expected 1 to'),
        ({'distortion_model': 'double_sphere'}, "'double_sphere' is not known; expected one of"),
        ({'camera_matrix': 5}, 'camera_matrix is 5; expected'),
        ({'camera_matrix': {'data': [1, 2]}}, 'camera_matrix has 2 numbers; expected 9'),
        ({'camera_matrix': {'data': [0] * 9}}, 'focal_x_px is 0.0; expected'),
        ({'distortion_coefficients': {'data': [0, 0, 0, float('nan')]}}, 'holds nan; expected'),
        ({'distortion_coefficients': {'data': ['a', 0, 0, 0]}}, "holds 'a'; expected finite"),
        (
            {'distortion_coefficients': {'data': [10**400, 0, 0, 0]}},
            'inf; expected finite',
        ),
        ({'distortion_model': ['fisheye']}, "distortion_model is .'fisheye'.; expected text"),
        ({'camera_name': {}}, 'camera_name is {}; expected text'),
        (
            {'distortion_coefficients': {'data': [0, 0, 0, 0, 0.1]}},
            '5 distortion coeff.* has 4',
        ),
        ({'projection_matrix': {'data': [0]}}, 'projection_matrix has 1 numbers; expected 12'),
    ],
)
def test_a_wrong_entry_is_named(tmp_path, change, words):
    path = tmp_path / 'camera.yaml'
    write_camera(path, CAMERA)
    path.write_text(yaml.safe_dump({**yaml.safe_load(path.read_text()), **change}))
    with pytest.raises(CameraFileError, match=words) as raised:
        read_camera(path)
    assert str(path) in str(raised.value)


@pytest.mark.parametrize(
    ('content', 'words'),
    [
        (b'', 'it is empty; expected'),
        (b'just text', 'it holds a single value; expected'),
        (b'a: [1, 2\nb: 3', 'not valid YAML at line 2'),
        (b'a: !!python/object/apply:os.system ["true"]', 'line 1: it has the tag'),
        (b'\xff\xfe\x00', 'is not text'),
        (b'a: \x00', 'not valid YAML'),
        (b'[' * 5000, 'line 1: it is more than 20 levels deep'),
        (b'a' * 2_000_000, 'larger than'),
    ],
)
def test_a_broken_file_is_refused(tmp_path, content, words):
    path = tmp_path / 'camera.yaml'
    path.write_bytes(content)
    with pytest.raises(CameraFileError, match=words):
        read_camera(path)


def test_a_missing_file_and_an_unwritable_place_are_named(tmp_path):
    with pytest.raises(FileAccessError, match='cannot be read: No such file'):
        read_camera(tmp_path / 'none.yaml')
    (tmp_path / 'file').write_text('')
    with pytest.raises(FileAccessError, match='cannot be written'):
        write_camera(tmp_path / 'file' / 'camera.yaml', CAMERA)


K = '[150.0, 0, 319.5, 0, 150.0, 239.5, 0, 0, 1]'
YAML = f"""
image_width: 640
image_height: 480
camera_name: left
camera_matrix: {{rows: 3, cols: 3, data: {K}}}
distortion_model: equidistant
distortion_coefficients: {{rows: 1, cols: 4, data: [-0.02, 0.004, -0.001, 0.0001]}}
"""
LENS = make_lens(
    'equidistant', 640, 480, [150, 0, 319.5, 0, 150, 239.5, 0, 0, 1], [-0.02, 0.004, -0.001, 1e-4]
)


@pytest.mark.parametrize(
    ('old', 'new'),
    [
        ('0.0001', '1e-04'),
        ('150.0', '1.5e2'),
        ('camera_name: left', 'camera_name:\tleft'),
        ('-0.02, ', '-0.02,\t'),
        ('0.0001', '0.0001, 0.0'),
        (K, '[[150, 0, 319.5], [0, 150, 239.5], [0, 0, 1]]'),
        ('640', '640.0'),
        ('\n', '\r\n'),
        ('\nimage_width', '%YAML:1.0\n---\nimage_width'),
        ('{rows: 3', '!!opencv-matrix {rows: 3'),
        ('camera_name', 'rest: &id001 [1, 2]\nmore: *id001\ncamera_name'),
        ('0.0001]}\n', '0.0001]}\n---\n'),
        ('0.0001]}\n', '0.0001]}\nrectification_matrix: {data: [0, 0, 0, 0, 0, 0, 0, 0, 0]}\n'),
    ],
)
def test_a_file_as_other_tools_write_it(tmp_path, old, new):
    path = tmp_path / 'camera.yaml'
    assert old in YAML
    path.write_bytes(YAML.replace(old, new).encode())
    assert read_camera(path) == Camera('left', LENS)


@pytest.mark.parametrize('name', ['0123', '1e5', 'true', '1.50', "'[19092272]'", '"a: b"'])
def test_a_name_is_the_text_that_stands_there(tmp_path, name):
    path = tmp_path / 'camera.yaml'
    path.write_text(YAML.replace('left', name))
    assert read_camera(path).name == name.strip('"\'')


@pytest.mark.parametrize(
    ('old', 'new', 'words'),
    [
        ('-0.02, 0.004, -0.001, 0.0001', '-0.02 0.004 -0.001 0.0001', 'with commas between them'),
        (
            'name: left',
            'name: [1909]',
            r'line 4: camera_name is \[1909\]; .*in quotes',
        ),
        ('distortion_model: eq', 'camera_model: eq', 'line 6: camera_model is .*: equidistant'),
        ('camera_matrix: {', 'camera_matrix:\n\tdata: {', 'line 6: a tab indents'),
        ('640', '640.5', 'line 2: image_width is 640.5; expected a whole number'),
        ('0.0001', '0.0001, 0.1', '5 distortion coefficients'),
    ],
)
def test_what_cannot_be_meant_is_named_with_its_line(tmp_path, old, new, words):
    path = tmp_path / 'camera.yaml'
    path.write_text(YAML.replace(old, new))
    with pytest.raises(CameraFileError, match=words):
        read_camera(path)


def test_a_camchain_of_kalibr_is_told_from_a_camera(tmp_path):
    path = tmp_path / 'camchain.yaml'
    path.write_text('cam0:\n  intrinsics: [150, 150, 319.5, 239.5]\n  resolution: [640, 480]\n')
    with pytest.raises(CameraFileError, match='camchain of Kalibr; expected a camera_info file'):
        read_camera(path)


ECHO = """header:
  frame_id: left
height: 480
width: 640
distortion_model: equidistant
d:
- -0.02
- 0.004
- -0.001
- 0.0001
k: [150.0, 0, 319.5, 0, 150.0, 239.5, 0, 0, 1]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""


def test_a_message_that_was_echoed_into_a_file(tmp_path):
    path = tmp_path / 'echo.yaml'
    for text in (ECHO, ECHO * 3, ECHO * 1000, ECHO.replace('\nd:', '\nD:').replace('k:', 'K:')):
        path.write_text(text)
        assert read_camera(path) == Camera('', LENS)
    path.write_text(ECHO.replace('binning_x: 0', 'binning_x: 2').replace('ing_y: 0', 'ing_y: 2'))
    assert read_camera(path).lens.width == 320
    path.write_text(ECHO.replace('x_offset: 0', 'x_offset: -1'))
    with pytest.raises(CameraFileError, match='line 15: x_offset is -1; expected 0 or more'):
        read_camera(path)


def test_nothing_but_yaml_is_written(tmp_path):
    with pytest.raises(FileAccessError, match=r'cannot be written as INI: expected .* \.yaml'):
        write_camera(tmp_path / 'left.ini', CAMERA)
