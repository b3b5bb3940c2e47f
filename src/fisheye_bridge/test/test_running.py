"""Nodes that are prepared for, spun, connected anew and ended."""

import os
import signal
from typing import ClassVar
from unittest.mock import Mock

import pytest
import rclpy
from rclpy.node import Node

from fisheye_bridge import running, shared_memory
from fisheye_bridge.running import run
from fisheye_bridge.watching import spin_until, started

SHORT_S, LONG_S = 0.05, 10.0


class Counter(Node):
    def __init__(self, step):
        super().__init__('counter')
        self.count = 0
        self.step = step
        self.create_timer(0.01, self.tick)

    def tick(self):
        self.count += self.step


@pytest.fixture
def prepared(monkeypatch):
    """Return the list of whether ROS was up when the shared memory was prepared."""
    seen = []

    def prepare():
        seen.append(rclpy.ok())
        return ''

    monkeypatch.setattr(shared_memory, 'prepare', prepare)
    return seen


def test_a_node_is_there_for_a_while(prepared):
    with started(Counter, 1) as node:
        assert spin_until(node, lambda: node.count >= 3, LONG_S)
        assert node.count == 3
    assert prepared == [False]
    assert not rclpy.ok()


def test_what_does_not_come_about_is_waited_for_only_so_long(prepared):
    with started(Counter, 0) as node:
        assert not spin_until(node, lambda: node.count, SHORT_S)


def test_a_node_that_cannot_be_built_leaves_nothing_behind(prepared):
    with pytest.raises(TypeError), started(Counter):
        pass
    assert not rclpy.ok()


class Heir(Node):
    """A node that ends the process once it has what a former one knew."""

    LIVES: ClassVar[list] = []

    def __init__(self, **kwargs):
        super().__init__('heir', **kwargs)
        self.declare_parameter('speed', 1)
        self.known = len(self.LIVES)
        self.LIVES.append(self)

    def inherit(self, former):
        self.known += former.known + self.get_parameter('speed').value
        os.kill(os.getpid(), signal.SIGTERM)


class ChangedOnce:
    """A network that changes under the first node."""

    def changed(self, _tell):
        if len(Heir.LIVES) > 1:
            return ''
        Heir.LIVES[0].set_parameters([rclpy.Parameter('speed', value=7)])
        return 'another address'


@pytest.fixture
def no_timer(monkeypatch):
    """Keep the process from being ended where its end takes too long."""
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    monkeypatch.setattr(running.threading, 'Timer', Mock())
    monkeypatch.setattr(running.threading, 'excepthook', running.threading.excepthook)
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


def test_a_node_that_connects_anew_inherits(prepared, no_timer, monkeypatch):
    monkeypatch.setattr(running, 'Links', ChangedOnce)
    monkeypatch.setattr(running, 'refuse_words', lambda: None)
    monkeypatch.setattr(running, 'usage', lambda _: '')
    Heir.LIVES.clear()
    assert run(Heir) == 0
    assert [node.known for node in Heir.LIVES] == [0, 1 + 0 + 7]
    assert not rclpy.ok()
