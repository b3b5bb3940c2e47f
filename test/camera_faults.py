"""What can happen to the left camera of a field, and what has to follow."""

import time

from diagnostic_msgs.msg import DiagnosticStatus
from field import START_S, Field

from fisheye_testing.mjpeg_server import jpeg
from fisheye_testing.waiting import wait_for

OK, WARN, ERROR = DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR
LIVELY = 0.7
"""Share of its pictures that a busy machine shows of the living side at least."""


def stop(cameras):
    cameras.stop('left')
    return lambda: cameras.start('left')


def stall(cameras):
    cameras.servers['left'].stalled.set()
    return cameras.servers['left'].stalled.clear


def send_garbage(cameras):
    cameras.show('left', bytes(range(256)) * 40)
    return lambda: cameras.show('left')


def send_nothing(cameras):
    cameras.show('left', b'')
    return lambda: cameras.show('left')


def come_back_smaller(cameras):
    def come_back(picture=None):
        cameras.stop('left')
        cameras.start('left')
        cameras.show('left', picture)

    come_back(jpeg(90, 320, 240))
    return come_back


def check_camera_fault(field: Field, break_it, capture: str, stitcher: str) -> None:
    """Break the left camera: dimmed and said; the right goes on; mended: all as before.

    Parameters
    ----------
    break_it
        One of the functions above; gives the one that mends.
    capture, stitcher
        The nodes that have to complain.
    """
    health, cameras = field.health, field.cameras

    def both_complain():
        lost = health.level(capture) == ERROR
        return (
            lost
            and health.level(stitcher) >= WARN
            and 'left: no picture for' in health.status[stitcher].message
        )

    # All is well, too, after a try that a busy machine was too slow for.
    wait_for(lambda: health.level(capture) < ERROR, START_S, 'a capture without ERROR')
    wait_for(lambda: health.level(stitcher) == OK, START_S, 'a stitcher that is well')
    begin_s = time.monotonic()
    with field.injured(f'left camera: {break_it.__name__}', 'left'):
        mend = break_it(cameras)
        try:
            wait_for(lambda: health.is_dim(health.seen[-1])[0], START_S, 'the dimming')
            wait_for(both_complain, START_S, 'the complaints')
            said = health.status[capture].message
            stamp_ns = time.time_ns()

            def is_lively():
                second_ago_s = time.monotonic() - 1
                living = [
                    entry
                    for entry in health.seen
                    if entry.stamp_ns > stamp_ns and entry.arrived_s > second_ago_s
                ]
                return len(living) > LIVELY * cameras.RATE_HZ

            wait_for(is_lively, START_S, 'the rate of the living side')
        finally:
            mend()
    assert health.came_in_order(begin_s), 'no picture came again, nor an older one'
    print(f'  {capture} said: {said}')
    wait_for(lambda: health.level(capture) < ERROR, START_S, 'no ERROR any more')
    wait_for(lambda: health.level(stitcher) == OK, START_S, 'all well')
