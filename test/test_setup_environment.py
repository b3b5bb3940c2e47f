import importlib.util
import platform
import sysconfig
from pathlib import Path

import pytest
import setup_environment


@pytest.fixture
def fit_machine(monkeypatch):
    """Let this machine pass every check, whatever it is."""
    monkeypatch.setattr(platform, 'system', lambda: 'Linux')
    monkeypatch.setattr(platform, 'machine', lambda: 'x86_64')
    return monkeypatch


def without_module(missing):
    find = importlib.util.find_spec
    return lambda name: None if name == missing else find(name)


def said(function, *arguments):
    with pytest.raises(SystemExit) as stopped:
        function(*arguments)
    return stopped.value.code


def test_fit_machine_passes(fit_machine):
    setup_environment.check_machine('')


def test_folder_that_colcon_cannot_work_in_is_refused(fit_machine):
    fit_machine.setattr(setup_environment, 'ROOT', Path('/home/me/my cameras'))
    assert '/home/me/my cameras' in said(setup_environment.check_machine, '')


def test_other_ros_is_refused(fit_machine):
    assert 'humble is sourced' in said(setup_environment.check_machine, 'humble')


def test_ros_that_is_named_but_not_sourced_is_refused(fit_machine):
    fit_machine.delenv('AMENT_PREFIX_PATH', raising=False)
    assert 'source /opt/ros/jazzy' in said(setup_environment.check_machine, 'jazzy')


def test_ros_of_another_python_is_refused(fit_machine):
    fit_machine.setenv('AMENT_PREFIX_PATH', '/opt/ros/jazzy')
    fit_machine.setattr(importlib.util, 'find_spec', without_module('rclpy'))
    assert 'make PYTHON=' in said(setup_environment.check_machine, 'jazzy')


def test_machine_without_wheels_is_refused(fit_machine):
    fit_machine.setattr(platform, 'machine', lambda: 'aarch64')
    assert 'no wheels of ROS 2 for Linux aarch64' in said(setup_environment.check_machine, '')


def test_missing_venv_names_its_package(fit_machine):
    fit_machine.setattr(importlib.util, 'find_spec', without_module('ensurepip'))
    assert '-venv' in said(setup_environment.check_machine, '')


def test_missing_headers_name_their_package(fit_machine, tmp_path):
    fit_machine.setattr(sysconfig, 'get_paths', lambda: {'include': tmp_path})
    assert '-dev' in said(setup_environment.check_machine, '')


def test_missing_compiler_names_its_package(fit_machine, tmp_path):
    fit_machine.setenv('PATH', str(tmp_path))
    assert 'apt install g++' in said(setup_environment.check_machine, '')


@pytest.fixture
def sourced_ros(monkeypatch, tmp_path):
    """Return a ROS with rclpy and colcon, beside which these requirements are looked for."""
    (tmp_path / 'share' / 'rclpy').mkdir(parents=True)
    colcon = tmp_path / 'colcon'
    colcon.write_text('')
    colcon.chmod(0o755)
    requirements = tmp_path / 'requirements.txt'
    requirements.write_text(
        '# a comment\n'
        'ros-jazzy-rclpy[fastrtps]==7.1.6    # nodes\n'
        'colcon-common-extensions==0.3.0     # builds\n'
        'opencv-python-headless==4.14.0.94   # remap\n'
        'pytest==9.2.0                       # tests\n'
    )
    monkeypatch.setenv('AMENT_PREFIX_PATH', f'/nowhere:{tmp_path}')
    monkeypatch.setenv('PATH', str(tmp_path))
    monkeypatch.setattr(setup_environment, 'REQUIREMENTS', requirements)
    return monkeypatch


def test_only_what_ros_lacks_is_added_beside_it(sourced_ros):
    sourced_ros.setattr(importlib.util, 'find_spec', without_module('cv2'))
    numpy, *others = setup_environment.missing_beside_ros()
    assert numpy.startswith('numpy==')
    assert others == ['opencv-python-headless<=4.14.0.94']


def test_missing_ros_package_is_named(sourced_ros, tmp_path):
    (tmp_path / 'share' / 'rclpy').rmdir()
    assert 'apt install ros-jazzy-rclpy' in said(setup_environment.missing_beside_ros)


def test_missing_colcon_names_its_package(sourced_ros, tmp_path):
    (tmp_path / 'colcon').unlink()
    assert 'python3-colcon-common-extensions' in said(setup_environment.missing_beside_ros)


def test_folders_of_another_machine_are_replaced(tmp_path):
    path = tmp_path / 'std_msgs' / 'cmake' / 'Export.cmake'
    path.parent.mkdir(parents=True)
    path.write_text(
        '"/opt/python/cp312-cp312/include/python3.12;'
        '/opt/python/cp312-cp312/lib/python3.12/site-packages/numpy/_core/include"'
    )
    setup_environment.correct_cmake_files(tmp_path, '/here')
    headers = sysconfig.get_paths()['include']
    assert path.read_text() == f'"{headers};/here/numpy/_core/include"'
