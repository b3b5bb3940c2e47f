"""A recording that is played: old stamps, and the time that comes with them."""

import threading

import numpy as np
import pytest
import rclpy
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Header

from fisheye_bridge.camera_info import camera_info_of
from fisheye_bridge.qos import IMAGE
from fisheye_bridge.stamps import stamp_of
from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera_file import Camera
from fisheye_testing.image_message import to_message
from fisheye_testing.waiting import wait_for

START_S = 40.0
RECORDED_NS = 1_600_000_000_000_000_000
PERIOD_S = 0.1
LENS = synthetic_lens(320, 240, np.radians(170))


class Player:
    """Plays what two cameras recorded, as rosbag2 does with `--clock`."""

    def __init__(self, domain):
        self._context = rclpy.Context()
        rclpy.init(context=self._context, domain_id=domain)
        self._node = rclpy.create_node('player', context=self._context)
        self._clock = self._node.create_publisher(Clock, '/clock', 10)
        self._eyes = [
            (
                Scene().view(LENS, Attitude(np.radians(yaw_deg))),
                camera_info_of(Camera(side, LENS), Header(frame_id=f'{side}_optical_frame')),
                self._node.create_publisher(Image, f'/{side}/image_raw', IMAGE),
                self._node.create_publisher(CameraInfo, f'/{side}/camera_info', IMAGE),
            )
            for side, yaw_deg in (('left', -70), ('right', 70))
        ]
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._play)
        self._thread.start()

    def stop(self):
        self._ended.set()
        self._thread.join()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)

    def _play(self):
        stamp_ns = RECORDED_NS
        while not self._ended.wait(PERIOD_S):
            stamp_ns += round(PERIOD_S * 1e9)
            stamp = stamp_of(stamp_ns)
            self._clock.publish(Clock(clock=stamp))
            for view, info, image, camera_info in self._eyes:
                info.header.stamp = stamp
                camera_info.publish(info)
                image.publish(to_message(view.frame(stamp_ns), 'bgr8', info.header))


@pytest.fixture
def player(domain):
    player = Player(domain)
    yield player
    player.stop()


def test_a_recording_is_stitched_with_its_own_stamps_and_time(rig, watcher, player):
    for node in ('left/undistort', 'right/undistort', 'stitch'):
        rig.start(node, use_sim_time=True)
    wait_for(lambda: rig.check_alive() or watcher.newest, START_S, 'a panorama')
    wait_for(
        lambda: watcher.overlaps and watcher.overlaps.overlaps[0].found, START_S, 'an overlap'
    )
    assert watcher.overlaps.overlaps[0].offset_deg == pytest.approx(140, abs=0.5)
    recorded = stamp_of(RECORDED_NS).sec
    assert 0 <= watcher.newest.header.stamp.sec - recorded < 2 * START_S
    # What the node announces goes by the recording's time too.
    assert 0 <= watcher.overlaps.header.stamp.sec - recorded < 2 * START_S
