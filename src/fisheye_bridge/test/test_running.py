"""What commands share: a node that is prepared for, spun and ended."""

import pytest
import rclpy
from rclpy.node import Node

from fisheye_bridge import shared_memory
from fisheye_bridge.running import spin_until, started

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
