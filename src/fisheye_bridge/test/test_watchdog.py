"""A process that hangs with the interpreter's lock in its hands, as publishing may."""

import subprocess
import sys

from fisheye_testing.waiting import PATIENCE_S

PROGRAM = """
import ctypes
from rclpy.node import Node
from fisheye_bridge import watchdog
from fisheye_bridge.running import run

watchdog.HANGS_S, watchdog._REARM_S = 1.0, 0.1

class Hanging(Node):
    def __init__(self):
        super().__init__('hanging')
        self.ticks = 0
        self.create_timer(0.01, self.tick)

    def tick(self):
        self.ticks += 1
        if self.ticks > 150:
            print('hangs', flush=True)
            ctypes.PyDLL(None).sleep(1000)

run(Hanging)
"""


def test_a_node_that_hangs_ends_and_says_where():
    """It is not ended before: its 150 ticks of 10 ms take longer than the watchdog waits."""
    process = subprocess.run(
        [sys.executable, '-c', PROGRAM],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )
    assert process.stdout == 'hangs\n'
    assert process.returncode == 1
    assert ' in tick' in process.stderr
