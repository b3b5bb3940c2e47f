"""Where a calibration is: paths, file:// and package://."""

from pathlib import Path

import pytest

from fisheye_capture import calibration_url
from fisheye_capture.calibration_url import calibration_of, calibration_path
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import SettingError
from fisheye_geometry.camera_file import Camera, write_camera


@pytest.mark.parametrize(
    ('url', 'path'),
    [
        ('calibration/left.yaml', Path('calibration/left.yaml')),
        ('/etc/left.yaml', Path('/etc/left.yaml')),
        ('~/left.yaml', Path.home() / 'left.yaml'),
        ('file:///etc/my%20left.yaml', Path('/etc/my left.yaml')),
        ('package://rig/config/left.yaml', Path('/share/rig/config/left.yaml')),
        ('file://${ROS_HOME}/camera_info/${NAME}.yaml', Path('/ros/camera_info/left.yaml')),
        ('package://rig/${NAME}/${NAME}.yaml', Path('/share/rig/left/left.yaml')),
        ('${ROS_HOME}/a.yaml', Path('/ros/a.yaml')),
        ('/etc/$NAME.yaml', Path('/etc/$NAME.yaml')),
    ],
)
def test_urls_name_files(monkeypatch, url, path):
    monkeypatch.setattr(
        calibration_url, 'get_package_share_directory', lambda name: f'/share/{name}'
    )
    monkeypatch.setenv('ROS_HOME', '/ros')
    assert calibration_path(url, 'left') == path


def test_ros_home_is_in_the_home_where_nothing_else_is_said(monkeypatch):
    monkeypatch.delenv('ROS_HOME', raising=False)
    path = calibration_path('file://${ROS_HOME}/camera_info/${NAME}.yaml', 'left')
    assert path == Path.home() / '.ros' / 'camera_info' / 'left.yaml'


@pytest.mark.parametrize('variable', ['${HOME}', '${}', '${NAME'])
def test_another_variable_is_named(variable):
    with pytest.raises(SettingError, match=r'camera_info_url has \$\{.*; expected'):
        calibration_path(f'file:///a/{variable}', 'left')


def test_an_empty_url_names_nothing():
    assert calibration_path('', 'left') is None
    assert calibration_of('', 'left') is None


def test_the_camera_of_a_file(tmp_path):
    camera = Camera('left', synthetic_lens(640, 480, 3.0))
    write_camera(tmp_path / 'left.yaml', camera)
    assert calibration_of(f'file://{tmp_path}/left.yaml', 'left').lens == camera.lens


@pytest.mark.parametrize('package', ['not_installed_anywhere', '..', ''])
def test_a_package_that_is_not_there_is_named(package):
    with pytest.raises(SettingError, match=f"names the package '{package}'"):
        calibration_path(f'package://{package}/left.yaml', 'left')


@pytest.mark.parametrize(
    ('url', 'told'),
    [('~no_such_user/left.yaml', 'a user who is not known'), ('file:///a%00b', 'a zero byte')],
)
def test_what_can_be_no_path_is_refused(url, told):
    with pytest.raises(SettingError, match=told):
        calibration_path(url, 'left')


def test_another_scheme_is_refused():
    with pytest.raises(SettingError, match="scheme 'http'; expected a path"):
        calibration_path('http://camera/left.yaml', 'left')
