"""Where the token is kept, and whom it is told."""

import os
import pty
import re
import subprocess
import sys
import time

import pytest
from serving import DEADLINE_S, token

from fisheye_core.errors import FileAccessError, FileContentError
from panorama_viewer.token import kept_token


def test_a_token_file_is_made_for_its_owner_and_read_again(serve, tmp_path):
    path = tmp_path / 'token'
    first = token(serve(host='0.0.0.0', token_file=str(path)))
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.read_text().strip() == first
    assert token(serve(host='0.0.0.0', token_file=str(path))) == first
    assert serve(token_file=str(tmp_path / 'unused')).url.endswith('/')
    assert not (tmp_path / 'unused').exists()


@pytest.mark.parametrize(
    ('content', 'sentence'),
    [
        ('short', 'holds no token; expected 8 to 100 letters'),
        ('with a space in it', 'holds no token'),
        ('x' * 10_000, 'holds no token'),
    ],
)
def test_a_token_file_that_holds_none_is_refused(tmp_path, content, sentence):
    path = tmp_path / 'token'
    path.write_text(content)
    path.chmod(0o600)
    with pytest.raises(FileContentError, match=sentence):
        kept_token(path)


def test_a_token_file_that_others_can_read_is_refused(tmp_path):
    path = tmp_path / 'token'
    path.write_text('12345678')
    path.chmod(0o644)
    told = 'used as token_file: others can read it, its mode is 644; expected 600'
    with pytest.raises(FileAccessError, match=told):
        kept_token(path)


def test_a_token_file_that_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / 'pipe', 0o600)
    for name, sentence in (('pipe', 'not a regular'), ('no/token', 'No such'), ('', 'directory')):
        with pytest.raises(FileAccessError, match=sentence):
            kept_token(tmp_path / name)


def run_node(folder, seconds_to_address, has_terminal):
    """Run the node until it has told its address; give terminal, output and log files."""
    leader, follower = pty.openpty()
    code = 'from panorama_viewer.viewer_node import main; main()'
    if has_terminal:
        take = f'import fcntl, termios; fcntl.ioctl({follower}, termios.TIOCSCTTY, 0); '
        code = take + code
    words = ['--ros-args', '-p', 'host:=0.0.0.0', '-p', 'port:=0']
    with (folder / 'output').open('wb') as output:
        process = subprocess.Popen(
            [sys.executable, '-c', code, *words],
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=output,
            start_new_session=True,
            pass_fds=(follower,),
            env={**os.environ, 'ROS_LOG_DIR': str(folder / 'log')},
        )
    os.close(follower)
    deadline = time.monotonic() + seconds_to_address
    expected = 'the panorama is at' if has_terminal else 'no terminal'

    def logs():
        return [path.read_text() for path in (folder / 'log').rglob('*') if path.is_file()]

    # Log files are written every few seconds; a busy node may end without writing the rest.
    while expected not in (folder / 'output').read_text() or expected not in ''.join(logs()):
        assert time.monotonic() < deadline, 'there was no address'
        time.sleep(0.05)
    terminal = os.read(leader, 1000).decode() if has_terminal else ''
    process.terminate()
    assert process.wait(DEADLINE_S) == 0
    os.close(leader)
    return terminal, (folder / 'output').read_text(), logs()


def test_the_token_goes_to_the_terminal_and_into_no_log(tmp_path):
    terminal, output, logs = run_node(tmp_path, 30.0, True)
    url, told = re.search(r'(http://\S+)#token=(\S+)', terminal).groups()
    assert any(url in log for log in logs)
    for text in (output, *logs):
        assert told not in text
        assert 'token=' not in text


def test_without_a_terminal_the_node_says_where_the_token_can_be_kept(tmp_path):
    _, output, logs = run_node(tmp_path, 30.0, False)
    assert 'set the parameter token_file' in output
    assert not any('token=' in text for text in (output, *logs))
