"""A process that hangs with the interpreter's lock in its hands, as publishing may."""

import subprocess
import sys

import pytest

from fisheye_testing.again import TooSlowError, asked_again

DEADLINE_S = 60.0
PROGRAM = """
import ctypes
import os
import signal
from time import monotonic
from rclpy.node import Node
from fisheye_bridge import watchdog
from fisheye_bridge.running import run
from fisheye_core.quiet_jpeg import without_libjpeg_lines

watchdog.HANGS_S, watchdog.ENDS_S, watchdog._REARM_S = 3.0, 2.0, 0.1

WHERE, DECODES = '{where}', {decodes}

def hang():
    if DECODES:
        without_libjpeg_lines().__enter__()
    print('hangs', flush=True)
    ctypes.PyDLL(None).sleep(1000)

class Hanging(Node):
    def __init__(self):
        super().__init__('hanging')
        self.begin_s = monotonic()
        self.create_timer(0.01, self.tick)

    def tick(self):
        if monotonic() - self.begin_s > 1.3 * watchdog.HANGS_S:
            hang() if WHERE == 'tick' else os.kill(os.getpid(), signal.SIGTERM)

    def destroy_node(self):
        hang()

run(Hanging)
"""


@pytest.mark.parametrize(
    ('where', 'decodes'), [('tick', False), ('tick', True), ('destroy_node', False)]
)
@asked_again
def test_a_node_that_hangs_ends_and_says_where(where, decodes):
    """It is not ended before, though it ticks for longer than the watchdog waits."""
    program = PROGRAM.replace('{where}', where).replace('{decodes}', str(decodes))
    process = subprocess.run(
        [sys.executable, '-c', program],
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )
    if not process.stdout:
        # A machine that is busy for as long as the watchdog waits looks like a hanging node.
        raise TooSlowError(process.stderr)
    assert process.stdout == 'hangs\n'
    assert process.returncode == 1
    assert f' in {where}' in process.stderr
