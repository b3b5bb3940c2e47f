"""What a node's process says to words that it does not understand."""

import signal
import sys
import threading
from dataclasses import dataclass

import pytest
from rclpy.node import Node

from fisheye_bridge.running import run
from fisheye_core.errors import SettingError
from fisheye_core.settings import setting


@dataclass(frozen=True)
class ExampleSettings:
    rate_hz: float = setting(30.0, 'How often.', minimum=1, maximum=60, live=True)
    cameras: tuple[str, ...] = setting(('left', 'right'), 'From left to right.')


class ExampleNode(Node):
    """Words to nothing."""

    SETTINGS = (('', ExampleSettings), ('CAMERA.', ExampleSettings))

    def __init__(self):
        super().__init__('example')
        signal.raise_signal(signal.SIGINT)


@pytest.fixture
def started(monkeypatch, capfd):
    """Run the node with words on its command line; give its exit code and what it said."""
    monkeypatch.setattr(threading, 'excepthook', threading.excepthook)
    # It would end this process, which goes on.
    monkeypatch.setattr(threading, 'Timer', lambda *_: threading.Thread(target=int))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}

    def start(*words, node_class=ExampleNode):
        monkeypatch.setattr(sys, 'argv', ['example_node', *words])
        code = run(node_class)
        return code, ''.join(capfd.readouterr())

    yield start
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.parametrize('words', [('-p', 'left.source:=7'), ('left.source:=7',), ('--verbose',)])
def test_words_without_a_meaning_are_refused(started, words):
    code, said = started(*words)
    assert code == 1
    assert f"'{' '.join(words)}' has no meaning here; expected --ros-args -p NAME:=VALUE" in said


@pytest.mark.parametrize('words', [('--help',), ('-h',), ('--ros-args', '--help')])
def test_help_says_how_to_give_parameters(started, words):
    code, said = started(*words)
    assert code == 0
    assert '--ros-args [-p NAME:=VALUE]' in said
    assert 'Words to nothing.' in said
    assert '  rate_hz* [30.0]: 1 to 60\n      How often.\n' in said
    assert '  CAMERA.cameras [[left, right]]\n      From left to right.\n' in said


class RefusingNode(Node):
    """One that does not like what it is given."""

    def __init__(self):
        super().__init__('example')
        raise SettingError('speed is 7; expected 1 to 5')


@pytest.mark.parametrize(
    ('words', 'name'),
    [
        ((), 'test_command_line'),
        (('-r', '__ns:=/left'), 'left.test_command_line'),
        (('-r', '__ns:=/left', '-r', '__node:=eye'), 'left.eye'),
    ],
)
def test_a_refusal_says_which_node_it_is(started, words, name):
    code, said = started('--ros-args', *words, node_class=RefusingNode)
    assert code == 1
    assert f'[{name}]: speed is 7; expected 1 to 5' in said


@pytest.mark.parametrize('words', [('--foo',), ('-p', 'x'), ('-r', '__ns:=bad-ns')])
def test_arguments_of_ros_that_cannot_be_are_refused(started, words):
    code, said = started('--ros-args', *words)
    assert code == 1
    assert 'what follows --ros-args cannot be understood: ' in said
    assert words[-1] in said


def test_arguments_of_ros_are_taken(started):
    assert started('--ros-args', '-r', '__ns:=/left', '--') == (0, '')
