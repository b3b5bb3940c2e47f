"""Free-running cameras through the real stitch node: a panorama for each frame of the slower."""

import random
import threading
import time
from contextlib import contextmanager

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticArray
from field import BUSY_S
from fisheye_msgs.msg import Projection
from rcl_interfaces.msg import Parameter as ParameterMessage
from rcl_interfaces.msg import ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fisheye_bridge.images import ImageBuffer
from fisheye_bridge.projection import projection_of
from fisheye_bridge.qos import IMAGE_INPUT, LATCHED
from fisheye_bridge.stamps import stamp_of
from fisheye_geometry.surface import Surface
from fisheye_testing.free_running import CameraTiming
from fisheye_testing.rig import SIDES
from fisheye_testing.waiting import wait_for

WATCHED_S = 8.0
START_S = 40.0
SETTLED = 30
"""Frames before the figures begin, and after their end until all panoramas have come."""
SCHEDULING = 0.1
"""Share of the frames that a busy machine may lose elsewhere."""
SURFACE = Surface('cylindrical', 64, 48, 20.0, 31.5, 23.5)
ENCODINGS = {'left': 'mono8', 'right': 'bgr8'}


class Publisher:
    """Two cameras whose corrected pictures come as they are due, from a thread."""

    def __init__(self, node, cameras, right_ahead_s=0.0):
        self._node, self._cameras = node, cameras
        self._ahead_ns = {'left': 0, 'right': round(right_ahead_s * 1e9)}
        self._end = threading.Event()
        self.sent_ns = {side: [] for side in SIDES}
        self._images, self._buffers = {}, {}
        for side, grey in zip(SIDES, (80, 160), strict=True):
            self._images[side] = node.create_publisher(Image, f'{side}/image_rect', IMAGE_INPUT)
            buffer = ImageBuffer(SURFACE.width, SURFACE.height, ENCODINGS[side])
            buffer.array[:] = grey if buffer.array.ndim == 2 else (grey, 20, 20)
            self._buffers[side] = buffer
        self._projections = [
            node.create_publisher(Projection, f'{side}/projection', LATCHED) for side in SIDES
        ]
        for publisher in self._projections:
            publisher.publish(projection_of(SURFACE, Header()))

    @contextmanager
    def running(self):
        thread = threading.Thread(target=self._run)
        thread.start()
        try:
            yield self
        finally:
            self._end.set()
            thread.join()

    def _run(self):
        chance = random.Random(0)
        begin_ns = time.time_ns()
        frames = sorted(
            (stamp_ms, side)
            for side, camera in zip(SIDES, self._cameras, strict=True)
            for stamp_ms in camera.stamps_ms(240.0, chance)
        )
        for stamp_ms, side in frames:
            stamp_ns = begin_ns + round(stamp_ms * 1e6)
            if self._end.wait(max(0.0, (stamp_ns - time.time_ns()) / 1e9)):
                return
            message = self._buffers[side].message
            message.header.stamp = stamp_of(stamp_ns + self._ahead_ns[side])
            self._images[side].publish(message)
            self.sent_ns[side].append(stamp_ns)


@pytest.mark.parametrize(
    ('rates_hz', 'phase'), [((30, 30), 0.5), ((30, 29.83), 0.0), ((30, 25), 0.3)]
)
def test_the_slower_camera_sets_the_rate(rig, watcher, rates_hz, phase):
    cameras = (
        CameraTiming(rates_hz[0], 0.0, 1.0),
        CameraTiming(rates_hz[1], phase * 1000 / 30, 1.0),
    )
    period_ns = 1e9 / rates_hz[1]
    rig.start('stitch', auto_calibrate=False, stale_after_s=5.0)
    with Publisher(watcher.node, cameras).running() as publisher:
        wait_for(lambda: rig.check_alive() or watcher.newest, START_S, 'a first panorama')
        frames_ns = publisher.sent_ns[SIDES[1]]

        def each_frame_has_one():
            begin = len(frames_ns) + SETTLED
            last = begin + int(WATCHED_S * rates_hz[1])
            wait_for(lambda: len(frames_ns) > last + SETTLED, START_S, 'enough frames')
            sent = frames_ns[begin:last]
            # The panorama has the older stamp of its pair.
            came = [s for s in watcher.stamps_ns if sent[0] - period_ns < s < sent[-1]]
            assert came == sorted(set(came)), 'each once, in order'
            print(f'\n{len(came)} panoramas of {len(sent)} frames')
            return (
                len(came) >= len(sent) * (1 - SCHEDULING)
                and abs(np.median(np.diff(came)) / period_ns - 1) < 0.25
            )

        # Other work on the machine ends some time.
        wait_for(each_frame_has_one, BUSY_S, 'the rate of the slower camera')
    assert watcher.newest.encoding == 'bgr8', 'colour beside grey'


def test_clocks_that_differ_are_told_with_the_remedy_which_works(rig, watcher):
    told = []
    watcher.node.create_subscription(
        DiagnosticArray, '/diagnostics', lambda m: told.append(m.status[0]), 10
    )
    client = watcher.node.create_client(SetParameters, 'stitch/set_parameters')
    rig.start('stitch', auto_calibrate=False, stale_after_s=5.0)
    cameras = CameraTiming(30, 0.0, 1.0), CameraTiming(30, 12.0, 1.0)

    def says(words):
        return rig.check_alive() or any(words in status.message for status in told[-1:])

    with Publisher(watcher.node, cameras, right_ahead_s=-37.0).running():
        wait_for(lambda: says('pair_by:=arrival'), START_S, 'the sentence about clocks')
        assert 'the stamps of the cameras are 37 s apart' in told[-1].message
        assert not any('shed' in status.message for status in told), 'the machine is not blamed'
        assert watcher.newest is None
        wait_for(client.service_is_ready, START_S, 'the parameters')
        value = ParameterValue(type=ParameterType.PARAMETER_STRING, string_value='arrival')
        asked = client.call_async(
            SetParameters.Request(parameters=[ParameterMessage(name='pair_by', value=value)])
        )
        wait_for(asked.done, START_S, 'an answer')
        assert asked.result().results[0].successful
        wait_for(lambda: len(watcher.stamps_ns) > SETTLED, START_S, 'panoramas')
        told.clear()
        wait_for(lambda: len(told) > 1, START_S, 'diagnostics')
    values = {entry.key: entry.value for entry in told[-1].values}
    assert values['latency'] == "not known: the stamps are 37 s behind this machine's clock"
    assert 'latency p50 ms' not in values
