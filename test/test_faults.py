"""Five nodes whose cameras go, stall and send nonsense; each killed and started again."""

import signal
import time

import camera_faults
import pytest
from camera_faults import ERROR, OK, check_camera_fault
from field import START_S

from fisheye_testing.again import asked_again
from fisheye_testing.rig import SEPARATE
from fisheye_testing.waiting import wait_for

SAME_PX = 1e-6
"""An offset that was kept, not measured again."""


@pytest.mark.parametrize(
    'break_it',
    [
        camera_faults.stop,
        camera_faults.stall,
        camera_faults.send_garbage,
        camera_faults.send_nothing,
        camera_faults.come_back_smaller,
    ],
)
@asked_again
def test_a_network_camera_is_lost_and_comes_back(five, break_it):
    check_camera_fault(five, break_it, 'left/capture', 'stitch')


@pytest.mark.parametrize('node', SEPARATE)
@asked_again
def test_a_node_is_killed_and_comes_back(five, node):
    health = five.health
    wait_for(lambda: health.is_measured, START_S, 'an overlap')
    (before,) = health.overlaps.overlaps
    side, begin_s = node.split('/')[0], time.monotonic()
    with five.injured(f'kill -9 of {node}', 'panorama' if node == 'stitch' else side, node=node):
        known = five.endpoints(node)
        five.stop(node, signal.SIGKILL)
        if node == 'stitch':
            health.overlaps = None
        else:
            wait_for(lambda: any(health.is_dim(health.seen[-1])), START_S, 'the dimming')
        five.start_again(node)
        wait_for(lambda: five.endpoints(node) - known, START_S, f'{node} in the graph')
    assert health.came_in_order(begin_s), 'no picture came again, nor an older one'
    wait_for(lambda: health.is_measured, START_S, 'the overlap')
    (after,) = health.overlaps.overlaps
    assert after.offset_x_px == pytest.approx(before.offset_x_px, abs=SAME_PX)
    assert after.found


@asked_again
def test_both_cameras_lost_is_no_picture_and_an_error(five):
    health, cameras = five.health, five.cameras
    wait_for(lambda: health.level('stitch') == OK, START_S, 'a stitch node that is well')
    with five.injured('both cameras stall', 'panorama', 'left', 'right'):
        for server in cameras.servers.values():
            server.stalled.set()
        nodes = ('left/capture', 'right/capture', 'stitch')
        wait_for(lambda: all(health.level(n) == ERROR for n in nodes), START_S, 'the ERRORs')
        count = len(health.seen)
        word = health.status['stitch']
        wait_for(lambda: health.status['stitch'] is not word, START_S, 'another second')
        assert len(health.seen) == count, 'nothing is published'
        for server in cameras.servers.values():
            server.stalled.clear()
    wait_for(lambda: health.level('stitch') == OK, START_S, 'all well')
