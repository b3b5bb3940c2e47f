"""What a node does about the addresses of its machine, and that Fast DDS can be told of them."""

import pytest
import rclpy

from fisheye_bridge.network import Links, addresses, forget_machine, refresher

LATER_S = 1.0
WIFI, OTHER_WIFI, LTE = '10.0.0.5', '10.0.0.6', '100.64.0.9'
ANEW, TOLD, NOTHING = 'anew', 'told', ''


class Machine:
    """A machine whose addresses are given, beside a clock that goes by hand."""

    def __init__(self, *found):
        self.found, self.now_s, self.told = set(found), 0.0, 0
        self.links = Links(lambda: set(self.found), lambda: self.now_s)

    def see(self, *found, can_tell=True):
        """Return what is done about new addresses."""
        self.found, told = set(found), self.told
        self.now_s += LATER_S
        if self.links.changed(lambda: self._tell(can_tell)):
            return ANEW
        return TOLD if self.told > told else NOTHING

    def _tell(self, can_tell):
        self.told += can_tell
        return can_tell


@pytest.fixture(autouse=True)
def reach(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'SUBNET')
    for name in ('ROS_LOCALHOST_ONLY', 'ROS_STATIC_PEERS'):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ('seen', 'expected'),
    [
        ([{WIFI}], NOTHING),
        ([{WIFI, LTE}], TOLD),
        ([set()], NOTHING),
        ([set(), {WIFI}], NOTHING),
        ([{OTHER_WIFI}], ANEW),
        ([set(), {LTE}], ANEW),
        ([{WIFI, LTE}, {LTE}], NOTHING),
        ([{WIFI, LTE}, {LTE}, {WIFI, LTE}], NOTHING),
        ([{WIFI, LTE}, *[{LTE}] * 30, {LTE, OTHER_WIFI}], TOLD),
        ([{WIFI, LTE}, *[set()] * 30, {OTHER_WIFI}], ANEW),
    ],
)
def test_of_what_changes_the_others_learn(seen, expected):
    machine = Machine(WIFI)
    *before, last = seen
    for found in before:
        assert machine.see(*found) != ANEW
    assert machine.see(*last) == expected


def test_the_first_address_gives_the_machine_a_name():
    assert Machine().see(WIFI) == ANEW


def test_a_middleware_that_cannot_be_told_is_started_anew():
    assert Machine(WIFI).see(WIFI, LTE, can_tell=False) == ANEW


@pytest.mark.parametrize('reach', ['LOCALHOST', 'OFF', 'localhost'])
def test_a_node_that_stays_on_its_machine_does_not_care(monkeypatch, reach):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', reach)
    assert Machine(WIFI).see(LTE) == NOTHING


def test_static_peers_are_on_other_machines(monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
    monkeypatch.setenv('ROS_STATIC_PEERS', '10.0.0.9')
    assert Machine(WIFI).see(LTE) == ANEW


def test_it_is_looked_at_now_and_then_only():
    machine = Machine(WIFI)
    machine.found = {LTE}
    machine.now_s = 0.01
    assert not machine.links.changed(lambda: True)


def test_addresses_are_those_that_others_can_use():
    for address in addresses():
        assert not address.startswith('127.')
        assert len(address.split('.')) == 4


def test_fast_dds_can_be_told_and_can_forget():
    for _ in range(2):
        rclpy.init()
        node = rclpy.create_node('told')
        assert refresher(node)()
        node.destroy_node()
        rclpy.shutdown()
        forget_machine()
