"""Which nodes the launch file starts, with which parameters; `test/test_launch.py` starts them."""

import sys

import pytest
from launch_file import CAPTURES, REST

TOPICS = {'left.source': 'topic', 'right.source': 'topic'}


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
        ({'views': '[front,rear]'}, r"views has '\[front'; expected a letter, then letters"),
        ({'views': 'front rear,'}, "views has 'front rear'; expected a letter, then letters"),
        ({'views': 'front,'}, "views has ''; expected a letter, then letters"),
        ({'views': 'left'}, "views has 'left', whose topics are those of a camera already"),
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


def test_a_file_that_includes_this_one_has_arguments_of_its_own(rig, monkeypatch):
    monkeypatch.setattr(sys, 'argv', ['ros2', 'launch', 'robot', 'bringup.launch.py'])
    assert set(rig.start(robot_name='x', robot='true')[0]) == CAPTURES


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
