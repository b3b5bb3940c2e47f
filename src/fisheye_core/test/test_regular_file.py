"""Regular files: bounded reading, and writing that leaves whole files and nothing else."""

import os
import signal
import subprocess
import sys

import pytest

from fisheye_core.errors import FileAccessError
from fisheye_core.regular_file import check_replaceable, read_regular, replace_regular
from fisheye_core.yaml_file import read_mapping, write_mapping


@pytest.fixture
def odd(tmp_path):
    """Make what is not a regular file, by its name in a sentence."""
    os.mkfifo(tmp_path / 'fifo')
    (tmp_path / 'folder').mkdir()
    return {
        'a FIFO': tmp_path / 'fifo',
        'a folder': tmp_path / 'folder',
        'a device': '/dev/zero',
    }


@pytest.mark.parametrize('kind', ['a FIFO', 'a folder', 'a device'])
def test_only_regular_files_are_read_and_replaced(odd, kind):
    told = f'it is {kind}; expected a regular file'
    with pytest.raises(FileAccessError, match=f'cannot be read: {told}'):
        read_mapping(odd[kind])
    with pytest.raises(FileAccessError, match=f'cannot be written: {told}'):
        write_mapping(odd[kind], {'a': 1})


@pytest.mark.parametrize(
    ('place', 'told'),
    [
        ('folder', 'it is a folder; expected a regular file'),
        ('fifo', 'it is a FIFO; expected a regular file'),
        ('file/a.yaml', 'Not a directory'),
        ('/proc/nowhere/a.yaml', 'proc'),
    ],
)
def test_what_cannot_be_replaced_is_refused_before(place, told, odd, tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(OSError, match=told):
        check_replaceable(tmp_path / place)


@pytest.mark.parametrize('place', ['file', 'new/and/newer/a.yaml'])
def test_looking_whether_a_file_can_be_replaced_leaves_no_trace(place, tmp_path):
    (tmp_path / 'file').write_text('old')
    check_replaceable(tmp_path / place)
    assert [path.name for path in tmp_path.rglob('*')] == ['file']
    assert (tmp_path / 'file').read_text() == 'old'


def test_a_link_stays_and_its_file_is_replaced(tmp_path):
    (tmp_path / 'there').mkdir()
    target, link = tmp_path / 'there' / 'a.yaml', tmp_path / 'link.yaml'
    link.symlink_to('there/a.yaml')
    for number in (1, 2):  # the link leads nowhere at first
        write_mapping(link, {'a': number})
        assert link.is_symlink()
        assert read_mapping(link) == read_mapping(target) == {'a': number}
    assert list(target.parent.iterdir()) == [target]


def test_a_link_in_a_circle_is_refused(tmp_path):
    (tmp_path / 'a').symlink_to('b')
    (tmp_path / 'b').symlink_to('a')
    with pytest.raises(FileAccessError, match='cannot be written'):
        write_mapping(tmp_path / 'a', {})


def test_no_more_is_read_than_is_wanted(tmp_path):
    (tmp_path / 'a').write_bytes(b'12345')
    assert read_regular(tmp_path / 'a', 3) == b'1234'
    assert read_regular(tmp_path / 'a', 5) == b'12345'


WRITER = """
import os, signal, sys
from fisheye_core import regular_file
if sys.argv[2]:
    os.fsync = lambda descriptor: os.kill(os.getpid(), signal.SIGKILL)
for number in range(200):
    regular_file.replace_regular(sys.argv[1], 'whole\\n' * 1000)
"""


def writer(path, killed=''):
    return subprocess.Popen([sys.executable, '-c', WRITER, str(path), killed])


def test_what_killed_writers_left_is_gone_after_the_next(tmp_path):
    path, other = tmp_path / 'over[lap].yaml', tmp_path / '.over[lap].yaml.swp'
    other.touch()
    replace_regular(path, 'old')
    writers = [writer(path, 'killed') for _ in range(3)]
    assert [process.wait(60) for process in writers] == [-signal.SIGKILL] * 3
    assert len(list(tmp_path.iterdir())) > 2
    assert path.read_text() == 'old'
    replace_regular(path, 'new')
    assert sorted(tmp_path.iterdir()) == [other, path]


def test_writers_beside_each_other_leave_one_whole_file(tmp_path):
    path = tmp_path / 'a.yaml'
    writers = [writer(path) for _ in range(2)]
    while any(process.poll() is None for process in writers):
        if path.exists():
            assert path.read_text() == 'whole\n' * 1000
    assert [process.wait() for process in writers] == [0, 0]
    assert list(tmp_path.iterdir()) == [path]
