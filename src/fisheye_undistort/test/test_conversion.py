"""Calibrations of other programs: ours must be where theirs is."""

import cv2
import numpy as np
import pytest
from conftest import fisheye
from foreign_lenses import foreign_lens

from fisheye_core.errors import CameraFileError, FisheyeError
from fisheye_geometry.camera_file import Camera, read_camera
from fisheye_undistort.fit.sheet_model import intrinsics_of
from fisheye_undistort.foreign.conversion import convert
from fisheye_undistort.foreign.foreign_models import fisheye as foreign_fisheye
from fisheye_undistort.foreign.lens_samples import samples_of_projection
from fisheye_undistort.foreign.written_formats import FORMATS, write_as
from fisheye_undistort.report.lens_difference import LensDifference

CLOSE_DEG = 0.05
"""Four coefficients follow other models that well."""
SIZE = (640, 480)


def camchain(model, intrinsics, distortion='none', coefficients=()):
    return (
        f'cam0:\n  camera_model: {model}\n  intrinsics: {list(intrinsics)}\n'
        f'  distortion_model: {distortion}\n  distortion_coeffs: {list(coefficients)}\n'
        '  resolution: [640, 480]\n'
    )


def mrcal(model, intrinsics):
    return (
        f"# a comment\n{{\n    'lensmodel':  '{model}',\n    'intrinsics': {list(intrinsics)},\n"
        "    'extrinsics': [0,0,0,0,0,0],\n    'imagersize': [640, 480],\n}\n"
    )


def pinhole_lens(k1, k2, p1, p2):
    """Project rays as OpenCV documents its model."""

    def project(rays):
        x, y = rays[:, 0] / rays[:, 2], rays[:, 1] / rays[:, 2]
        r = x * x + y * y
        radial = 1 + k1 * r + k2 * r * r
        u = x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x)
        v = y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y
        return np.stack([400 * u + 320, 401 * v + 240], axis=-1)

    return project


def mei(rays):
    x, y, z = rays.T / np.linalg.norm(rays, axis=-1)
    return np.stack([300 * x / (z + 0.9) + 320, 301 * y / (z + 0.9) + 240], axis=-1)


def stereographic(rays):
    x, y, z = rays.T / np.linalg.norm(rays, axis=-1)
    return np.stack([200 * 2 * x / (1 + z) + 320, 200 * 2 * y / (1 + z) + 240], axis=-1)


def demand(lens, project, reach_deg):
    """Demand that a lens maps rays out to an angle as `project` does."""
    angle, azimuth = np.meshgrid(np.radians(np.arange(1.0, reach_deg, 4)), np.arange(0, 6.3, 0.4))
    side = np.sin(angle)
    rays = np.stack([side * np.cos(azimuth), side * np.sin(azimuth), np.cos(angle)], axis=-1)
    rays = rays.reshape(-1, 3)
    expected = project(rays)
    inside = np.all((expected > 0) & (expected < np.array(SIZE) - 1), axis=-1)
    assert inside.sum() > 50
    back, seen = lens.unproject(expected[inside])
    assert seen.all()
    apart = np.linalg.norm(back - rays[inside], axis=-1)
    assert np.degrees(apart.max()) < CLOSE_DEG


def ocam_text(lens):
    a2, a3, a4 = lens.distortion
    focal = lens.focal_x_px
    # Their polynomial gives the depth in px behind the lens, by the radius in px.
    depth = [-focal, 0, -a2 / focal, -a3 / focal**2, -a4 / focal**3]
    return (
        '#polynomial coefficients for the DIRECT mapping function\n\n'
        f'5 {" ".join(map(str, depth))}\n\n#inverse\n\n3 1 1 1\n\n#center\n\n'
        f'{lens.center_y_px} {lens.center_x_px}\n\n#affine parameters\n\n1.0 0.0 0.0\n\n'
        '#image size\n\n480 640\n'
    )


OCAM_AHEAD = (
    '#polynomial coefficients for\n\n5 500.0 0 1e-3 0 0\n\n#inverse\n\n3 1 1 1\n\n#center\n\n'
    '238 322\n\n#affine parameters\n\n1.0 0.0 0.0\n\n#image size\n\n480 640\n'
)
"""Its axis points ahead, where Scaramuzza's points back."""


def test_double_sphere_of_kalibr(tmp_path):
    truth = foreign_lens('double_sphere', 200)
    xi, alpha = truth.distortion
    scale = 1 + xi
    text = camchain(
        'ds',
        [
            xi,
            alpha,
            truth.focal_x_px * scale,
            truth.focal_y_px * scale,
            truth.center_x_px,
            truth.center_y_px,
        ],
    )
    (tmp_path / 'chain.yaml').write_text(text)
    conversion = convert(tmp_path / 'chain.yaml')
    assert conversion.good
    demand(conversion.lens, lambda rays: truth.project(rays)[0], 99)


def test_a_file_of_mrcal_may_hold_what_it_was_fitted_to(tmp_path):
    text = mrcal('LENSMODEL_STEREOGRAPHIC', [200, 200, 320, 240])
    text = text.replace('}', f"    'optimization_inputs': b'{'0' * 400_000}',\n}}")
    (tmp_path / 'camera.cameramodel').write_text(text)
    assert convert(tmp_path / 'camera.cameramodel').worst_deg < CLOSE_DEG


def test_a_lens_whose_axis_is_not_that_of_its_camera(monkeypatch):
    lens = [200.0, 201.0, 320.0, 240.0, 0.02, -0.01, 0.003, -0.001]
    rotation = cv2.Rodrigues(np.radians([3.0, -2.0, 1.0]))[0]
    project = foreign_fisheye(*lens[:4], lens[4:])
    samples = samples_of_projection(lambda rays: project(rays @ rotation.T), SIZE)
    reader = 'fisheye_undistort.foreign.conversion.read_foreign'
    monkeypatch.setattr(reader, lambda *_: (samples, 'a spline'))
    conversion = convert('spline.cameramodel')
    assert conversion.worst_deg < 1e-3
    assert np.allclose(intrinsics_of(conversion.lens), lens, atol=1e-3)
    assert str(conversion).endswith('degrees; the camera is turned by 3.7 degrees')


def test_ocam(tmp_path):
    truth = foreign_lens('ocam', 190)
    even = type(truth)(
        640, 480, truth.focal_x_px, truth.focal_x_px, 322.0, 238.0, truth.distortion
    ).with_max_angle(np.radians(100))
    (tmp_path / 'calib_results.txt').write_text(ocam_text(even))
    conversion = convert(tmp_path / 'calib_results.txt')
    assert conversion.model == 'OCam'
    demand(conversion.lens, lambda rays: even.project(rays)[0], 95)


@pytest.mark.parametrize(
    ('text', 'project', 'reach_deg'),
    [
        pytest.param(camchain('omni', [0.9, 300, 301, 320, 240]), mei, 85, id='omni'),
        pytest.param(
            camchain('pinhole', [400, 401, 320, 240], 'radtan', [-0.2, 0.03, 0.0, 0.0]),
            pinhole_lens(-0.2, 0.03, 0, 0),
            44,
            id='radtan',
        ),
        pytest.param(
            mrcal('LENSMODEL_STEREOGRAPHIC', [200, 200, 320, 240]),
            stereographic,
            85,
            id='mrcal stereographic',
        ),
        pytest.param(
            mrcal('LENSMODEL_OPENCV4', [400, 401, 320, 240, -0.2, 0.03, 0, 0]),
            pinhole_lens(-0.2, 0.03, 0, 0),
            44,
            id='mrcal OPENCV4',
        ),
        pytest.param(
            mrcal(
                'LENSMODEL_SPLINED_STEREOGRAPHIC_order=3_Nx=10_Ny=8_fov_x_deg=170',
                [200, 200, 320, 240, *[0.0] * 160],
            ),
            stereographic,
            70,
            id='mrcal spline',
        ),
    ],
)
def test_models_of_other_programs(text, project, reach_deg, tmp_path):
    (tmp_path / 'camera.txt').write_text(text)
    conversion = convert(tmp_path / 'camera.txt')
    assert conversion.worst_deg < CLOSE_DEG
    demand(conversion.lens, project, reach_deg)


@pytest.mark.parametrize('k1', [-0.09, -0.14])
def test_a_lens_whose_curve_ends_inside_the_picture_is_converted_exactly(k1, tmp_path):
    text = camchain('pinhole', [190, 190, 320, 240], 'equidistant', [k1, 0.0, 0.0, 0.0])
    (tmp_path / 'chain.yaml').write_text(text)
    assert convert(tmp_path / 'chain.yaml').worst_deg < 1e-3


def test_what_four_coefficients_cannot_follow_is_told(tmp_path):
    text = camchain('pinhole', [400, 401, 320, 240], 'radtan', [-0.2, 0.03, 0.01, 0.02])
    (tmp_path / 'camera.yaml').write_text(text)
    conversion = convert(tmp_path / 'camera.yaml')
    assert not conversion.good
    assert conversion.worst_px > 1
    assert f'{conversion.worst_px:.2f} px' in str(conversion)


def opencv_camera(focal, number='', indent=''):
    """Return K and D as OpenCV writes them."""
    matrices = ('K', 3, [focal, 0.0, 320.0, 0.0, focal, 240.0, 0.0, 0.0, 1.0]), ('D', 1, [0.0] * 4)
    return ''.join(
        f'{indent}{key}{number}: !!opencv-matrix\n{indent}   rows: {rows}\n'
        f'{indent}   cols: {len(data) // rows}\n{indent}   dt: d\n{indent}   data: {data}\n'
        for key, rows, data in matrices
    )


CHAIN = camchain('ds', [-0.2, 0.5, 200, 200, 320, 240]) + camchain(
    'pinhole', [150, 150, 320, 240], 'equidistant', [0.0] * 4
).replace('cam0', 'cam1')
OPENCV = '%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n'
PAIR = OPENCV + opencv_camera(200.0, '1') + opencv_camera(150.0, '2')
PARTS = (
    f'{OPENCV}left:\n{opencv_camera(200.0, indent="   ")}'
    f'right:\n{opencv_camera(150.0, indent="   ")}'
)


@pytest.mark.parametrize(
    ('text', 'camera', 'names'),
    [
        pytest.param(CHAIN, 'cam1', 'cam0, cam1', id='kalibr'),
        pytest.param(PAIR, '2', '1, 2', id='OpenCV stereo'),
        pytest.param(PARTS, 'right', 'left, right', id='OpenCV parts'),
    ],
)
def test_one_of_several_cameras_must_be_chosen(text, camera, names, tmp_path):
    path = tmp_path / 'pair.yaml'
    path.write_text(text)
    for asked in ('', 'top'):
        told = rf'pair\.yaml: it holds {names}; choose one with --camera {camera}'
        with pytest.raises(CameraFileError, match=told):
            convert(path, asked)
    assert abs(convert(path, camera).lens.focal_x_px - 150) < 1e-3


def test_a_camera_of_a_file_that_names_none_is_refused(tmp_path):
    (tmp_path / 'calib_results.txt').write_text(OCAM_AHEAD)
    with pytest.raises(CameraFileError, match=r'calib_results\.txt: it names no .* \'cam1\''):
        convert(tmp_path / 'calib_results.txt', 'cam1')


@pytest.mark.parametrize('kind', FORMATS)
def test_what_is_written_is_read_again(kind, tmp_path):
    lens = fisheye(190)
    path = tmp_path / 'camera.yaml'
    write_as(kind, path, Camera('left', lens), 'calibrated out to 80 degrees')
    assert '# calibrated out to 80 degrees' in path.read_text()
    back = convert(path)
    assert back.good
    assert np.nanmax(LensDifference(lens, back.lens).apart_deg) < 1e-3


def test_ros_reads_what_is_written_for_it(tmp_path):
    write_as('ros', tmp_path / 'camera.yaml', Camera('left', fisheye(190)), 'two\nlines')
    assert read_camera(tmp_path / 'camera.yaml').name == 'left'


@pytest.mark.parametrize(
    ('text', 'told'),
    [
        ('nothing: here\n', 'image_width'),
        (camchain('fov', [1, 2, 3, 4, 5]), 'its model is fov with none; expected pinhole, omni'),
        (camchain('ds', [1, 2, 3]), 'it lacks something'),
        (mrcal('LENSMODEL_CAHVOR', [1, 2, 3, 4]), 'LENSMODEL_CAHVOR; expected LENSMODEL_PINHOLE'),
        (mrcal('LENSMODEL_PINHOLE', [1, 2]), 'it lacks something'),
        ('#polynomial coefficients for\n3 1 2\n', 'expected 3'),
        ('width: 640\n\ncamera_model: pinhole\n', 'image_height'),
        ('cams:\n  camera_model: pinhole\n', 'it lacks something'),
        ('x: 3\n camera_model: pinhole\n', 'it lacks something|not'),
        (OCAM_AHEAD, 'the model sees nothing of its picture'),
        ('%YAML:1.0\n---\nK: 3\n', 'it lacks something|it has none of'),
        ('%YAML:1.0\n---\nimage_width: 640\nimage_h', 'it lacks something'),
        ("{'lensmodel': open('/etc/passwd')}", 'it lacks something|image_width|not'),
    ],
)
def test_files_that_describe_no_lens_are_refused_by_name(text, told, tmp_path):
    (tmp_path / 'odd.yaml').write_text(text)
    with pytest.raises(FisheyeError, match=rf'odd\.yaml.*({told})') as error:
        convert(tmp_path / 'odd.yaml')
    assert isinstance(error.value, CameraFileError)
