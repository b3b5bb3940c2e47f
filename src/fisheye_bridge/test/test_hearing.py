"""Whom a node can see and does not hear."""

from time import monotonic

import pytest
import rclpy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from rclpy.executors import SingleThreadedExecutor

from fisheye_bridge.hearing import DEAF_S, GONE_S, TOPIC, Hearing
from fisheye_bridge.qos import HEARTBEAT

WAIT_S, LATER_S = 20.0, 1.0


class NodePair:
    """A node that listens, and another one that promises reports, or does not."""

    def __init__(self, qos):
        self.now_s = 0.0
        self.listener, self.other = rclpy.create_node('listener'), rclpy.create_node('other')
        self.publisher = self.other.create_publisher(DiagnosticArray, TOPIC, qos)
        self.hearing, self.messages = Hearing(self.listener, lambda: self.now_s), []
        self.listener.create_subscription(DiagnosticArray, TOPIC, self.messages.append, 10)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self.listener)

    def spin_until(self, condition):
        deadline_s = monotonic() + WAIT_S
        while not (value := condition()):
            assert monotonic() < deadline_s
            self._executor.spin_once(timeout_sec=0.05)
        return value

    def say(self, name):
        status = DiagnosticStatus(name=name, hardware_id=f'/{name}')
        self.publisher.publish(DiagnosticArray(status=[status]))

    def hear(self, name):
        """Publish a report of a node, and wait until it was taken."""
        self.messages.clear()
        self.say(name)
        self.spin_until(lambda: self.messages)
        self._executor.spin_once(timeout_sec=0.05)

    def is_seen(self):
        return self.listener.count_publishers(TOPIC)

    def silence_after(self, later_s):
        self.hearing.silence()
        self.now_s += later_s
        return self.hearing.silence()


@pytest.fixture
def pair(request):
    rclpy.init()
    pair = NodePair(getattr(request, 'param', HEARTBEAT))
    pair.spin_until(pair.is_seen)
    yield pair
    for node in (pair.listener, pair.other):
        node.destroy_node()
    rclpy.shutdown()


def test_who_is_seen_and_not_heard_is_named(pair):
    assert not pair.silence_after(DEAF_S / 2)
    assert pair.silence_after(DEAF_S) == 'other can be seen, but nothing comes from there'


def hear_other(pair):
    def is_heard():
        pair.say('other')
        return 'other' not in pair.silence_after(LATER_S)

    assert 'other' in pair.silence_after(2 * DEAF_S) + pair.silence_after(LATER_S)
    pair.spin_until(is_heard)


def test_who_was_heard_once_may_be_silent(pair):
    hear_other(pair)
    assert not pair.silence_after(10 * DEAF_S)


def test_one_that_is_not_heard_beside_others_is_named(pair):
    third = rclpy.create_node('third')
    third.create_publisher(DiagnosticArray, TOPIC, HEARTBEAT)
    pair.spin_until(lambda: pair.is_seen() == 2)
    hear_other(pair)
    while not (silence := pair.silence_after(LATER_S)):
        pair.hear('other')
    assert silence == 'third can be seen, but nothing comes from there'
    assert pair.now_s > GONE_S, 'it may have been killed before its first report'
    assert not pair.hearing.is_well
    third.destroy_node()
    pair.spin_until(lambda: pair.is_seen() == 1)
    pair.hear('other')
    assert not pair.silence_after(LATER_S)
    assert pair.hearing.is_well


def test_one_that_was_started_again_is_to_be_heard_again(pair):
    hear_other(pair)
    pair.other.destroy_publisher(pair.publisher)
    pair.spin_until(lambda: not pair.is_seen())
    pair.publisher = pair.other.create_publisher(DiagnosticArray, TOPIC, HEARTBEAT)
    pair.spin_until(pair.is_seen)
    assert not pair.silence_after(LATER_S)
    assert pair.silence_after(2 * DEAF_S) == 'other can be seen, but nothing comes from there'
    hear_other(pair)


@pytest.mark.parametrize('pair', [10], indirect=True)
def test_who_promises_nothing_may_be_silent(pair):
    assert not pair.silence_after(10 * DEAF_S)
