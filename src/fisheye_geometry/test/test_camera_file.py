"""camera_info YAML: read, written, and refused with precise sentences."""

import pytest
import yaml

from fisheye_geometry.camera_file import Camera, read_camera, write_camera
from fisheye_geometry.errors import CameraFileError
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
        ({'distortion_coefficients': {'data': [10**400, 0, 0, 0]}}, '0; expected finite numbers'),
        ({'distortion_model': ['fisheye']}, "distortion_model is .'fisheye'.; expected text"),
        ({'camera_name': {}}, 'camera_name is {}; expected text'),
        ({'distortion_coefficients': {'data': [0] * 5}}, '5 distortion coefficients; .* has 4'),
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
        (b'', 'holds NoneType; expected'),
        (b'just text', 'holds str; expected'),
        (b'a: [1, 2\nb: 3', 'not valid YAML at line 2'),
        (b'a: !!python/object/apply:os.system ["true"]', 'not valid YAML at line 1'),
        (b'\xff\xfe\x00', 'is not text'),
        (b'a: \x00', 'not valid YAML'),
        (b'[' * 5000, 'not valid YAML'),
        (b'a' * 2_000_000, 'larger than'),
    ],
)
def test_a_broken_file_is_refused(tmp_path, content, words):
    path = tmp_path / 'camera.yaml'
    path.write_bytes(content)
    with pytest.raises(CameraFileError, match=words):
        read_camera(path)


def test_a_missing_file_and_an_unwritable_place_are_named(tmp_path):
    with pytest.raises(CameraFileError, match='cannot be read: No such file'):
        read_camera(tmp_path / 'none.yaml')
    (tmp_path / 'file').write_text('')
    with pytest.raises(CameraFileError, match='cannot be written'):
        write_camera(tmp_path / 'file' / 'camera.yaml', CAMERA)


def test_what_a_few_lines_could_blow_up_is_refused(tmp_path):
    path = tmp_path / 'camera.yaml'
    path.write_text('image_width: 640\na: &many [1, 2]\ncamera_matrix: [*many, *many]\n')
    with pytest.raises(CameraFileError, match='refers to `&many` at line 3; expected plain'):
        read_camera(path)
    path.write_text(f'image_width: 0x{"f" * 5000}')
    with pytest.raises(CameraFileError, match=r'image_width is .*; expected a whole number'):
        read_camera(path)
