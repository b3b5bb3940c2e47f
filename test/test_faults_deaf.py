"""Nodes that hear nothing though all is there: killed ones started again, one without its port."""

import os
import signal
import time
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pytest
from field import START_S, UNNOTICED_S
from sensor_msgs.msg import Image

from fisheye_testing.domains import ports
from fisheye_testing.image_message import stamp_ns
from fisheye_testing.waiting import wait_for

KILLS = 100 if os.environ.get('LONG') else 3
NODES = ('left/capture', 'left/undistort', 'stitch')
"""Of one side: a new picture behind them has passed the one that was killed."""

ANEW = 'connecting anew'
LOOKED_FOR = 120
"""Pictures of so many seconds that a port would be missed again meanwhile."""


class Stamps:
    """Newest stamps, ns, of what the left undistort and stitch publish."""

    def __init__(self, health):
        self._health, self._corrected_ns = health, 0
        health.node.create_subscription(Image, 'left/image_rect', self._take, 1)

    def are_after(self, moment_ns):
        return min(self._corrected_ns, self._health.stamps_ns[-1]) > moment_ns

    def _take(self, message):
        self._corrected_ns = stamp_ns(message.header)


def test_no_killed_node_stays_deaf(five):
    health, stamps = five.health, Stamps(five.health)
    took_s = {node: [] for node in NODES}
    for node in islice(cycle(NODES), KILLS):
        five.stop(node, signal.SIGKILL)
        begin_ns, begin_s = time.time_ns(), time.monotonic()
        five.start_again(node)
        wait_for(lambda ns=begin_ns: stamps.are_after(ns), START_S, f'a picture through {node}')
        took_s[node].append(time.monotonic() - begin_s)
        # Later than a picture from before the kill is shown.
        settled_s = max(begin_s + 2 * UNNOTICED_S, time.monotonic())
        wait_for(lambda s=settled_s: health.whole(s), START_S, f'a whole panorama with {node}')
        five.check_alive()
    for node, seconds in took_s.items():
        print(
            f'\n{node} killed {len(seconds)} times: pictures again after '
            f'{np.median(seconds):.1f} s (median), {max(seconds):.1f} s (worst)',
            end='',
        )
    anew = sum(five.log(node).read_text().count('connecting anew') for node in five.processes)
    print(f'\nnodes connected anew {anew} times')


@pytest.mark.parametrize('others', [(), ('right/capture',)], ids=['alone', 'beside others'])
def test_a_node_whose_port_one_does_not_find_connects_anew(rig, watcher, domain, others):
    count = [0]

    def take(_message):
        count[0] += 1

    watcher.node.create_subscription(Image, 'left/image_rect', take, 1)
    for node in ('left/capture', *others):
        rig.start(node)
        topic = node.replace('capture', 'image_raw')
        wait_for(lambda topic=topic: watcher.node.count_publishers(topic), START_S, node)
    known = ports(domain)
    capture = rig.processes['left/capture']
    capture.send_signal(signal.SIGSTOP)
    try:
        rig.start('left/undistort')
        (port,) = wait_for(lambda: ports(domain) - known, START_S, 'the port of undistort')
        for node in others:
            maps = Path(f'/proc/{rig.processes[node].pid}/maps')
            wait_for(lambda maps=maps: port.name in maps.read_text(), START_S, f'{node} at it')
        port.unlink()
        topic = 'left/image_rect'
        wait_for(lambda: watcher.node.count_publishers(topic), START_S, 'undistort')
    finally:
        # It now makes a port of that name, at which nobody listens.
        capture.send_signal(signal.SIGCONT)
    begin_s, log = time.monotonic(), rig.log('left/undistort')
    wait_for(lambda: ANEW in log.read_text(), START_S, 'the sentence')
    wait_for(lambda: rig.check_alive() or count[0], START_S, 'a corrected picture')
    print(f'\na deaf node: pictures after {time.monotonic() - begin_s:.1f} s')


def test_a_node_whose_port_is_taken_away_connects_anew(rig, watcher, domain):
    """Those that begin later could not reach it, and it would know nothing of them."""
    known = ports(domain)
    rig.start('left/undistort')
    (port,) = wait_for(lambda: ports(domain) - known, START_S, 'the port of undistort')
    wait_for(lambda: watcher.node.count_publishers('left/image_rect'), START_S, 'undistort')
    port.unlink()
    rig.start('left/capture')
    log = rig.log('left/undistort')
    wait_for(lambda: f'others cannot find {port}: {ANEW}' in log.read_text(), START_S, 'it')
    taken = []
    watcher.node.create_subscription(Image, 'left/image_rect', taken.append, 1)
    wait_for(lambda: rig.check_alive() or len(taken) > LOOKED_FOR, START_S, 'pictures')
    assert log.read_text().count(ANEW) == 1
