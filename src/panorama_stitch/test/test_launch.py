"""Which nodes the launch file starts, with which parameters; `test/test_launch.py` starts them."""

import importlib.util
import sys
from math import degrees, radians
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
import yaml
from ament_index_python.packages import PackageNotFoundError

from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.surface_kind import KINDS

FILE = Path(__file__).parents[1] / 'launch' / 'panorama.launch.py'
CAPTURES = {'left/capture', 'right/capture'}
REST = {'left/undistort', 'right/undistort', 'stitch'}
TOPICS = {'left.source': 'topic', 'right.source': 'topic'}
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


def loaded():
    spec = importlib.util.spec_from_file_location('panorama_launch', FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class LaunchFile:
    """The launch file with stubs in the place of launch."""

    def __init__(self, monkeypatch):
        self.warnings = []
        logger = SimpleNamespace(warning=self.warnings.append)
        stubs = {
            'launch': {
                'LaunchDescription': list,
                'logging': SimpleNamespace(get_logger=lambda _: logger),
            },
            'launch.actions': {
                'DeclareLaunchArgument': lambda name, **_: name,
                'OpaqueFunction': dict,
                'SetEnvironmentVariable': lambda *words: words,
            },
            'launch_ros': {},
            'launch_ros.actions': {'Node': SimpleNamespace, 'SetParameter': lambda *words: words},
        }
        for name, content in stubs.items():
            module = ModuleType(name)
            vars(module).update(content)
            monkeypatch.setitem(sys.modules, name, module)
        self.file = loaded()
        monkeypatch.setattr(self.file, 'get_package_prefix', lambda _: '/usr')

    def start(self, **given):
        """Return the nodes by name and the value of use_sim_time."""
        values = {name: value for name, (value, _) in self.file.ARGUMENTS.items()}
        words = [f'{name}:={value}' for name, value in given.items()]
        context = SimpleNamespace(argv=words, launch_configurations={**values, **given})
        (_, sim_time), *nodes = self.file.start(context)
        return {f'{vars(n).get("namespace", "")}/{n.name}'.strip('/'): n for n in nodes}, sim_time

    def given(self, node):
        """Return the parameters of a node beside its file."""
        return node.parameters[1]


@pytest.fixture
def rig(monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'panorama_stitch', FILE.name])
    return LaunchFile(monkeypatch)


@pytest.fixture
def overlap_file(tmp_path):
    path = tmp_path / 'overlap.yaml'
    path.write_text(yaml.safe_dump(OVERLAP))
    return path


@pytest.mark.parametrize(
    ('given', 'expected'),
    [
        ('', CAPTURES | REST),
        ('composed', {'panorama'}),
        ('robot', CAPTURES),
        ('base', REST),
        ('base composed', {'panorama'}),
        ('robot base', CAPTURES | REST),
        ('robot base composed', CAPTURES | {'panorama'}),
        ('view', CAPTURES | REST | {'viewer'}),
        ('robot view', CAPTURES),
    ],
)
def test_which_nodes(rig, given, expected):
    nodes, _ = rig.start(**dict.fromkeys(given.split(), 'True'))
    assert set(nodes) == expected


def test_what_is_given_reaches_the_nodes_that_it_concerns(rig):
    nodes, sim_time = rig.start(left_source='0', frame_rate_hz='15', use_sim_time='on')
    assert rig.given(nodes['left/capture']) == {'source': '0', 'frame_rate_hz': 15.0}
    assert rig.given(nodes['right/capture']) == {'frame_rate_hz': 15.0}
    assert rig.given(nodes['stitch']) == {}
    assert sim_time is True
    assert nodes['left/capture'].package == 'fisheye_capture'
    assert nodes['left/capture'].executable == 'capture_node'


def test_only_the_panorama_node_takes_topics(rig):
    given = {'base': 'true', 'composed': 'true', 'left_source': '0'}
    alone, _ = rig.start(**given)
    nodes, _ = rig.start(**given, robot='true')
    assert rig.given(nodes['panorama']) == rig.given(alone['panorama']) == TOPICS
    assert rig.given(nodes['left/capture']) == {'source': '0'}


def test_the_file_of_parameters_must_be_there(rig, tmp_path):
    path = tmp_path / 'rig.yaml'
    with pytest.raises(RuntimeError, match=r"params_file is '.*rig.yaml', which is not a file"):
        rig.start(params_file=str(path))
    path.touch()
    nodes, _ = rig.start(params_file=str(path))
    assert {node.parameters[0] for node in nodes.values()} == {str(path)}


def test_views_go_to_the_node_that_makes_the_panorama(rig):
    for composed, name in (('false', 'stitch'), ('true', 'panorama')):
        nodes, _ = rig.start(views='front, rear', composed=composed)
        assert rig.given(nodes[name])['views'] == ['front', 'rear']


def test_files_in_the_home(rig, tmp_path, monkeypatch):
    monkeypatch.setenv('HOME', str(tmp_path))
    nodes, _ = rig.start(overlap_file='~/overlap.yaml')
    assert rig.given(nodes['stitch']) == {'overlap_file': f'{tmp_path}/overlap.yaml'}


@pytest.mark.parametrize(
    ('given', 'words'),
    [
        ({'composed': 'maybe'}, "composed is 'maybe'; expected true or false"),
        ({'use_sim_time': '2'}, "use_sim_time is '2'; expected true or false"),
        ({'frame_rate_hz': 'fast'}, "frame_rate_hz is 'fast'; expected a number"),
        ({'vfov_deg': '60'}, "no argument 'vfov_deg'; expected cameras, composed, "),
        ({'cameras': 'front,front'}, 'cameras is front,front; expected 1 to 8 different names'),
        ({'cameras': 'a,b,c,d,e,f,g,h,i'}, 'cameras is a,b,c,d,e,f,g,h,i; expected 1 to 8'),
        ({'cameras': 'front,2nd'}, "cameras has '2nd'; expected names of a letter, then"),
        ({'cameras': ''}, "cameras has ''; expected names of a letter, then"),
        ({'front_source': '0'}, "no argument 'front_source'; expected cameras, .*, left_source"),
        (
            {'cameras': 'a,b', 'left_source': '0'},
            "no argument 'left_source'; expected .*, a_source",
        ),
        (
            {'cameras': 'a,b,c', 'transforms': 'true', 'yaw_deg': '90'},
            'yaw_deg is the angle between two cameras; there are 3',
        ),
        ({'transforms': 'true'}, 'needs yaw_deg or overlap_file'),
        ({'transforms': 'true', 'yaw_deg': 'abc'}, "yaw_deg is 'abc'; expected a number"),
        ({'transforms': 'true', 'yaw_deg': 'nan'}, "yaw_deg is 'nan'; expected a number"),
    ],
)
def test_what_cannot_be_meant_is_refused(rig, given, words):
    with pytest.raises(RuntimeError, match=words):
        rig.start(**given)


@pytest.mark.parametrize('word', ['true', 'True', '1', 'yes', 'on'])
def test_words_for_true(rig, word):
    assert set(rig.start(composed=word)[0]) == {'panorama'}


@pytest.mark.parametrize('word', ['false', '0', 'no', 'OFF'])
def test_words_for_false(rig, word):
    assert set(rig.start(composed=word)[0]) == CAPTURES | REST


def test_every_node_is_started_again_after_a_pause(rig):
    nodes, _ = rig.start(view='true')
    assert all(node.respawn and node.respawn_delay > 0 for node in nodes.values())


def test_nothing_starts_where_the_transforms_cannot(rig, monkeypatch):
    def missing(package):
        raise PackageNotFoundError(package)

    monkeypatch.setattr(rig.file, 'get_package_prefix', missing)
    with pytest.raises(RuntimeError, match='transforms:=true needs the package tf2_ros'):
        rig.start(transforms='true', yaw_deg='140')


def test_a_file_that_includes_this_one_has_arguments_of_its_own(rig, monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'robot', 'bringup.launch.py'])
    assert set(rig.start(robot_name='x', robot='true')[0]) == CAPTURES


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


@pytest.mark.parametrize('composed', ['true', 'false'])
def test_any_cameras(rig, composed):
    nodes, _ = rig.start(
        cameras='front, right,rear/high', composed=composed, robot='true', base='true',
        front_source='0', right_source='2', right_camera_info_url='/r.yaml',
        **{'rear/high_region': 'left'},
    )  # fmt: skip
    names = ('front', 'right', 'rear/high')
    nodes_of_all = {'panorama'} if composed == 'true' else {f'{n}/undistort' for n in names}
    assert nodes_of_all | {f'{name}/capture' for name in names} <= set(nodes)
    assert rig.given(nodes['front/capture']) == {'source': '0'}
    assert rig.given(nodes['right/capture']) == {'source': '2', 'camera_info_url': '/r.yaml'}
    assert rig.given(nodes['rear/high/capture']) == {'region': 'left'}
    last = rig.given(nodes['panorama' if composed == 'true' else 'stitch'])
    assert last['cameras'] == list(names)
    if composed == 'true':
        assert last['front.source'] == 'topic'
        assert last['right.camera_info_url'] == '/r.yaml'


def test_one_camera(rig):
    nodes, _ = rig.start(cameras='ring', composed='true', ring_source='0')
    assert rig.given(nodes['panorama']) == {'cameras': ['ring'], 'ring.source': '0'}


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


@pytest.mark.parametrize('chosen', ['', '/my/profile.xml'])
def test_a_profile_that_the_user_chose_stays(rig, monkeypatch, chosen):
    monkeypatch.delenv('FASTRTPS_DEFAULT_PROFILES_FILE', raising=False)
    if chosen:
        monkeypatch.setenv('FASTRTPS_DEFAULT_PROFILES_FILE', chosen)
    (profile,) = (
        words[1]
        for words in rig.file.generate_launch_description()
        if type(words) is tuple and words[0] == rig.file.PROFILES
    )
    assert profile == chosen or (not chosen and profile.endswith('/fastdds.xml'))
