"""Commands: exit codes and sentences, and readers that leave."""

import subprocess
import sys

import pytest

from fisheye_core.command_line import CommandParser, exit_code, show_progress
from fisheye_core.errors import SettingError, SourceError

LINES = 100_000
"""More than a pipe holds."""
PROGRAM = f"""
import sys
from fisheye_core.command_line import exit_code
def command():
    for _ in range({LINES}):
        print('a line')
    return 0
sys.exit(exit_code('talk', command))
"""


def interrupt():
    raise KeyboardInterrupt


def refuse():
    raise SourceError('there is no picture')


@pytest.mark.parametrize(
    ('command', 'code', 'said'),
    [
        (lambda: 2, 2, ''),
        (refuse, 1, 'look: there is no picture\n'),
        (interrupt, 130, ''),
    ],
)
def test_what_ends_a_command_is_its_code(command, code, said, capsys):
    assert exit_code('look', command) == code
    assert capsys.readouterr().err == said


def test_words_that_are_not_known_are_refused():
    with pytest.raises(SettingError, match=r'unrecognized arguments: --far \(see look --help\)'):
        CommandParser(prog='look').parse_args(['--far'])


@pytest.mark.parametrize(
    ('columns', 'shown'), [('', '\rsix views  '), ('80', '\rsix views  '), ('6', '\rsix v')]
)
def test_progress_stays_on_one_line_of_the_terminal(columns, shown, monkeypatch, capsys):
    monkeypatch.setenv('COLUMNS', columns)
    show_progress('six views', 11)
    assert capsys.readouterr().err == shown


def test_a_reader_that_leaves_ends_a_command_without_a_word():
    process = subprocess.Popen(
        [sys.executable, '-c', PROGRAM], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout.readline() == b'a line\n'
    process.stdout.close()
    assert process.stderr.read() == b''
    process.stderr.close()
    assert process.wait() == 141
