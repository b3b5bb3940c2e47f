"""The transforms that the launch file publishes: of an angle, or of an overlap file."""

from math import degrees, radians

import numpy as np
import pytest
import yaml
from ament_index_python.packages import PackageNotFoundError
from launch_file import CAPTURES, REST

from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.surface_kind import KINDS

SIZE = {'width': 600, 'height': 300, 'focal_px': 200.0, 'center_y_px': 150.0}
SURFACE = {'surface': 'cylindrical', **SIZE}
MEASURED = {'method': 'particles', 'found': True, 'overlap_px': 200.0, 'confidence': 0.9}
LEVEL = {'offset_x_px': 390.0, 'offset_y_px': 0.0, 'pitch_deg': 0.0, 'roll_deg': 0.0}
OVERLAP = {
    'version': 1,
    'cameras': [
        {'name': 'left', **SURFACE, 'center_x_px': 300.0},
        {'name': 'right', **SURFACE, 'center_x_px': 310.0},
    ],
    'overlaps': [{'left': 'left', 'right': 'right', **MEASURED, **LEVEL}],
}
"""Its angle is 2 rad."""
RING = ('front', 'right', 'rear', 'left')


def ring(cameras=RING, **changes):
    """Return the overlap file of a ring whose cameras look down by 10 degrees each."""
    step = Attitude(0.0, radians(-10)).matrix.T @ Attitude(radians(90), radians(-10)).matrix
    angles = Attitude.of(step)
    entry = {
        **MEASURED, **LEVEL, 'near_deg': 0.0, 'offset_x_px': 300.0,
        'yaw_deg': degrees(angles.yaw_rad),
        'pitch_deg': degrees(angles.pitch_rad),
        'roll_deg': degrees(angles.roll_rad),
    }  # fmt: skip
    pairs = zip(cameras, (*cameras[1:], cameras[0]), strict=True)
    return {
        'version': 2,
        'cameras': [{'name': name, **SURFACE, 'center_x_px': 300.0} for name in cameras],
        'overlaps': [{'left': left, 'right': right, **entry} for left, right in pairs],
        **changes,
    }


@pytest.fixture
def overlap_file(tmp_path):
    path = tmp_path / 'overlap.yaml'
    path.write_text(yaml.safe_dump(OVERLAP))
    return path


def test_nothing_starts_where_the_transforms_cannot(rig, monkeypatch):
    def missing(package):
        raise PackageNotFoundError(package)

    monkeypatch.setattr(rig.file, 'get_package_prefix', missing)
    with pytest.raises(RuntimeError, match='transforms:=true needs the package tf2_ros'):
        rig.start(transforms='true', yaw_deg='140')


def test_transforms_of_a_given_and_of_a_measured_angle(rig, overlap_file):
    transforms = {'left_transform', 'right_transform'}
    measured, _ = rig.start(transforms='true', overlap_file=str(overlap_file))
    given, _ = rig.start(transforms='true', yaw_deg='114.591559026')
    assert set(measured) == set(given) == CAPTURES | REST | transforms
    for name in transforms:
        assert measured[name].arguments == given[name].arguments
    assert turn_of(given['left_transform'])[1] == pytest.approx(-0.479425539)


def turn_of(node):
    """Return the quaternion that a transform publishes."""
    words = node.arguments
    return [float(words[words.index(f'--q{axis}') + 1]) for axis in 'xyzw']


def test_transforms_of_a_closed_ring_are_level(rig, overlap_file):
    overlap_file.write_text(yaml.safe_dump(ring()))
    nodes, _ = rig.start(transforms='true', cameras=','.join(RING), overlap_file=str(overlap_file))
    turns = {name: turn_of(nodes[f'{name}_transform']) for name in RING}
    for name, yaw_deg in zip(RING, (-135, -45, 45, 135), strict=True):
        expected = quaternion(Attitude(radians(yaw_deg), radians(-10)))
        assert np.abs(turns[name]) == pytest.approx(np.abs(expected), abs=1e-6)
    assert nodes['front_transform'].arguments[3] == 'front_optical_frame'


def test_an_overlap_file_of_other_cameras_is_a_sentence(rig, overlap_file):
    with pytest.raises(RuntimeError, match='overlap file of front, rear: it is for the cameras'):
        rig.start(transforms='true', cameras='front,rear', overlap_file=str(overlap_file))


def test_a_pair_that_was_not_found_has_no_transforms(rig, overlap_file):
    content = ring()
    del content['overlaps'][1]['yaw_deg']
    content['overlaps'][1]['found'] = False
    overlap_file.write_text(yaml.safe_dump(content))
    with pytest.raises(RuntimeError, match='holds no angle between the cameras; give yaw_deg'):
        rig.start(transforms='true', cameras=','.join(RING), overlap_file=str(overlap_file))


@pytest.mark.parametrize('kind', KINDS)
def test_an_offset_is_an_angle_where_the_kind_of_surface_says_so(rig, overlap_file, kind):
    overlap_file.write_text(overlap_file.read_text().replace('cylindrical', kind))
    if KINDS[kind].yaw_is_column_shift:
        assert 'left_transform' in rig.start(transforms='true', overlap_file=str(overlap_file))[0]
    else:
        with pytest.raises(RuntimeError, match='holds no angle between the cameras'):
            rig.start(transforms='true', overlap_file=str(overlap_file))


def test_transforms_wait_for_a_file_that_is_not_there_yet(rig, tmp_path):
    nodes, _ = rig.start(transforms='true', overlap_file=str(tmp_path / 'later.yaml'))
    assert set(nodes) == CAPTURES | REST
    (warning,) = rig.warnings
    assert 'later.yaml is not there yet' in warning


@pytest.mark.parametrize(
    'content', ['', 'image_width: 640', 'cameras: [a]\noverlaps: 3', '{[', 'a: !!bool b']
)
def test_a_foreign_file_is_a_sentence(rig, overlap_file, content):
    overlap_file.write_text(content)
    with pytest.raises(RuntimeError, match='is not the overlap file of left, right: '):
        rig.start(transforms='true', overlap_file=str(overlap_file))
