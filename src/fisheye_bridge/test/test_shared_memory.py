"""Shared memory: what the dead left is cleared, and too little of it is said."""

import fcntl
import os
import re
from pathlib import Path
from types import SimpleNamespace

import pytest
from ament_index_python.packages import get_package_share_directory

from fisheye_bridge import shared_memory
from fisheye_bridge.shared_memory import prepare

PROFILE = 'FASTRTPS_DEFAULT_PROFILES_FILE'
NOW_S = 1e9


@pytest.fixture
def room(monkeypatch, tmp_path):
    """Set how many MiB are left, and give the file of the profile in use."""
    for name in ('fastdds.xml', 'fastdds_small.xml'):
        (tmp_path / name).touch()
    monkeypatch.setenv(PROFILE, str(tmp_path / 'fastdds.xml'))
    monkeypatch.delenv('RMW_IMPLEMENTATION', raising=False)

    def leave(mib, flags=0):
        state = SimpleNamespace(f_bavail=mib << 8, f_frsize=4096, f_flag=flags)
        monkeypatch.setattr(shared_memory.os, 'statvfs', lambda folder: state)

    return leave


def segment(folder, name, age_s):
    lock = folder / f'fastrtps_{name}_el'
    (folder / f'fastrtps_{name}').write_bytes(b'x' * 100)
    lock.touch()
    os.utime(lock, (0, NOW_S - age_s))
    return lock


def test_enough_is_used_without_a_word(room, tmp_path):
    room(1000)
    assert prepare(tmp_path) == ''
    assert os.environ[PROFILE] == str(tmp_path / 'fastdds.xml')


@pytest.mark.parametrize(
    ('mib', 'words', 'profile'),
    [
        (64, 'has room for 64 MiB; expected 72 .*may be lost', 'fastdds_small.xml'),
        (2, 'has room for 2 MiB; expected 72 .*go over UDP', 'fastdds.xml'),
    ],
)
def test_too_little_is_said(room, tmp_path, mib, words, profile):
    room(mib)
    assert re.search(words, prepare(tmp_path))
    assert os.environ[PROFILE] == str(tmp_path / profile)


def test_what_cannot_be_written_has_no_room(room, tmp_path):
    room(1000, os.ST_RDONLY)
    assert 'has room for 0 MiB' in prepare(tmp_path)
    assert 'has room for 0 MiB' in prepare(tmp_path / 'nowhere')


def test_the_users_own_profile_stays(room, tmp_path, monkeypatch):
    monkeypatch.setenv(PROFILE, str(tmp_path / 'own.xml'))
    room(64)
    assert 'go over UDP' in prepare(tmp_path)
    assert os.environ[PROFILE] == str(tmp_path / 'own.xml')


def test_without_a_profile_the_package_gives_its_own(room, tmp_path, monkeypatch):
    share = Path(get_package_share_directory('fisheye_bridge'), 'config')
    monkeypatch.delenv(PROFILE)
    room(1000)
    assert prepare(tmp_path) == ''
    assert os.environ[PROFILE] == str(share / 'fastdds.xml')
    assert Path(os.environ[PROFILE]).is_file()
    monkeypatch.delenv(PROFILE)
    room(64)
    assert 'may be lost' in prepare(tmp_path)
    assert os.environ[PROFILE] == str(share / 'fastdds_small.xml')


def test_another_middleware_is_left_alone(monkeypatch, tmp_path):
    monkeypatch.setenv('RMW_IMPLEMENTATION', 'rmw_cyclonedds_cpp')
    assert prepare(tmp_path / 'nowhere') == ''


def test_only_what_the_dead_left_is_cleared(room, tmp_path, monkeypatch):
    room(1000)
    monkeypatch.setattr(shared_memory.time, 'time', lambda: NOW_S)
    dead, alive = segment(tmp_path, '0' * 16, 60), segment(tmp_path, '1' * 16, 60)
    young, port = segment(tmp_path, '2' * 16, 0.5), segment(tmp_path, 'port7000', 60)
    with alive.open('rb') as owner:
        fcntl.flock(owner, fcntl.LOCK_EX)
        prepare(tmp_path)
    assert not dead.exists()
    assert not (tmp_path / dead.name.removesuffix('_el')).exists()
    for lock in (alive, young, port):
        assert lock.exists()
        assert (tmp_path / lock.name.removesuffix('_el')).exists()
