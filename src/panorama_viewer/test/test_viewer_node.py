"""The viewer node in this process, with a node beside it in the place of the stitching."""

import json
import threading
import time
from array import array
from functools import partial
from math import nan, tau

import aiohttp
import pytest
import rclpy
import serving
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from fisheye_msgs.msg import Overlap, Overlaps, Projection
from fisheye_msgs.srv import CalibrateOverlap
from rclpy.duration import Duration
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import CompressedImage

from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_bridge.stamps import stamp_of
from fisheye_core.errors import SettingError
from fisheye_testing.waiting import wait_for
from panorama_viewer import viewer_node
from panorama_viewer.viewer_node import ViewerNode

DEADLINE_S = 15.0
JPEG = b'\xff\xd8 as it is \xff\xd9'


class Stitching(Node):
    """Publishes what the stitch node would, in the namespace /rig."""

    def __init__(self, context, stamp=None):
        super().__init__('stitch', context=context, namespace='/rig')
        self.stamp = stamp
        self.image = self.create_publisher(CompressedImage, 'panorama/image/compressed', IMAGE)
        self.projection = self.create_publisher(Projection, 'panorama/projection', LATCHED)
        self.overlap = self.create_publisher(Overlaps, 'panorama/overlap', LATCHED)
        self.diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 10)
        self.create_timer(0.05, self.publish)

    def publish(self):
        message = CompressedImage(format='bgr8; jpeg compressed bgr8', data=array('B', JPEG))
        message.header.stamp = self.stamp or self.get_clock().now().to_msg()
        self.image.publish(message)
        skew = [KeyValue(key='skew median ms', value='2.5')]
        self.diagnostics.publish(
            DiagnosticArray(
                status=[
                    DiagnosticStatus(name='rig/left/capture', level=b'\2', message='unplugged'),
                    DiagnosticStatus(name='other/left/capture', level=b'\2', message='not ours'),
                    DiagnosticStatus(name='rig/stitch', values=skew),
                ]
            )
        )


@pytest.fixture
def ros():
    """Return a context whose nodes, once added to the executor, spin in a thread."""

    class Ros:
        context = rclpy.Context()
        nodes = ()

        def __init__(self):
            rclpy.init(context=self.context)
            self.executor = SingleThreadedExecutor(context=self.context)
            self.is_done = False
            self.thread = threading.Thread(target=self.spin)

        def start(self, *nodes):
            self.nodes = nodes
            for node in nodes:
                self.executor.add_node(node)
            self.thread.start()

        def spin(self):
            while not self.is_done:
                self.executor.spin_once(timeout_sec=0.05)

        def stop(self):
            self.is_done = True
            if self.nodes:
                self.thread.join()
            for node in self.nodes:
                node.destroy_node()
            self.executor.shutdown()
            rclpy.shutdown(context=self.context)

    ros = Ros()
    yield ros
    ros.stop()


def viewer(ros, **parameters):
    return ViewerNode(
        context=ros.context,
        namespace='/rig',
        parameter_overrides=[Parameter(name, value=v) for name, v in parameters.items()],
    )


visit = partial(serving.visit, deadline_s=DEADLINE_S)


def look(node):
    """Return the first picture that a browser is shown."""

    async def look(session):
        async with session.ws_connect(f'{node.url}live') as stream:
            async for message in stream:
                if message.type is aiohttp.WSMsgType.BINARY:
                    return message.data
        return pytest.fail('the stream ended without a picture')

    return visit(look)


def test_pictures_go_to_the_browser_as_they_are_and_only_while_one_looks(ros):
    stitching, node = Stitching(ros.context), viewer(ros, port=0)
    ros.start(stitching, node)
    wait_for(lambda: stitching.projection.get_subscription_count())
    assert not stitching.image.get_subscription_count()

    assert look(node) == JPEG
    wait_for(lambda: not stitching.image.get_subscription_count())
    assert look(node) == JPEG


def test_the_page_is_told_what_the_rig_says(ros):
    stitching, node = Stitching(ros.context), viewer(ros, port=0)
    stitching.projection.publish(
        Projection(
            surface='cylindrical',
            width=1000,
            height=300,
            focal_px=1000 / tau,
            center_x_px=499.5,
            wraps=True,
        )
    )
    overlaps = [
        Overlap(
            left_camera='left',
            right_camera='right',
            found=True,
            yaw_deg=120.0,
            confidence=confidence,
            seam_begin_px=240.0,
            left_end_px=confidence,
        )
        for confidence in (0.9, nan)
    ]
    stitching.overlap.publish(Overlaps(overlaps=overlaps))
    ros.start(stitching, node)

    async def hear(session):
        async with session.ws_connect(f'{node.url}live') as stream:
            async for message in stream:
                if message.type is not aiohttp.WSMsgType.TEXT:
                    await stream.send_str('drawn')
                    continue
                told = json.loads(message.data)
                if all(told.get(key) for key in ('projection', 'overlaps', 'problems', 'rate_hz')):
                    return told
        return pytest.fail('the stream ended before all was told')

    told = visit(hear)
    assert told['projection']['surface'] == 'cylindrical'
    assert told['projection']['focal_px'] == 1000 / tau
    assert told['projection']['wraps'] is True
    # JSON has no NaN, and a browser would refuse it.
    assert [overlap['confidence'] for overlap in told['overlaps']] == [0.9, None]
    assert [overlap['left_end_px'] for overlap in told['overlaps']] == [0.9, None]
    assert told['overlaps'][0]['seam_begin_px'] == 240.0
    assert 'left and right overlap, 120.0° apart' in told['overlaps'][0]['words']
    assert [problem['text'] for problem in told['problems']] == ['Left camera: unplugged']
    assert told['skew_ms'] == 2.5
    assert 0 <= told['delay_ms'] < 1000 * DEADLINE_S


def test_the_page_is_told_what_the_robot_is_like_also_while_it_looks(ros):
    node = viewer(ros, port=0, robot_width_m=0.6)
    ros.start(node)

    async def hear(session):
        heard = []
        async with session.ws_connect(f'{node.url}live') as stream:
            async for message in stream:
                told = json.loads(message.data)
                heard.append((told.get('robot_width_m'), told.get('camera_height_m')))
                if len(heard) == 1:
                    node.set_parameters([Parameter('camera_height_m', value=0.4)])
                if heard[-1] == (0.6, 0.4):
                    return heard
        return pytest.fail('the stream ended before all was told')

    assert visit(hear)[0] == (0.6, 0.0)
    for value in (-1.0, 30.0, nan):
        (answer,) = node.set_parameters([Parameter('robot_width_m', value=value)])
        assert not answer.successful
        assert 'robot_width_m' in answer.reason


def test_a_negative_stamp_is_a_stamp_too(ros):
    stitching, node = Stitching(ros.context, stamp_of(-1)), viewer(ros, port=0)
    ros.start(stitching, node)

    assert look(node) == JPEG


def test_the_delay_of_a_recording_goes_by_its_own_time(ros):
    stitching, node = Stitching(ros.context), viewer(ros, port=0, use_sim_time=True)
    stitching.set_parameters([Parameter('use_sim_time', value=True)])
    player = Node('player', context=ros.context)
    clock = player.create_publisher(Clock, '/clock', 10)
    recorded = Time(nanoseconds=1_600_000_000_000_000_000)
    begin = time.monotonic()

    def play():
        now = recorded + Duration(seconds=time.monotonic() - begin)
        clock.publish(Clock(clock=now.to_msg()))

    player.create_timer(0.02, play)
    ros.start(stitching, node, player)

    async def hear(session):
        async with session.ws_connect(f'{node.url}live') as stream:
            async for message in stream:
                if message.type is aiohttp.WSMsgType.TEXT:
                    told = json.loads(message.data)
                    if told.get('delay_ms') is not None:
                        return told
        return pytest.fail('the stream ended without a delay')

    assert -100 <= visit(hear)['delay_ms'] < 1000 * DEADLINE_S


def press_calibrate(node):
    async def press(session):
        async with session.post(f'{node.url}calibrate') as reply:
            return reply.status, await reply.text()

    return visit(press)


@pytest.mark.parametrize('save', [False, True])
def test_the_button_has_the_overlap_measured(ros, save):
    stitching, node = Stitching(ros.context), viewer(ros, port=0, save=save)

    def calibrate(request, response):
        response.success = (request.method, request.save) == ('', save)
        response.overlaps = [
            Overlap(
                left_camera='left',
                right_camera='right',
                found=True,
                yaw_deg=140.2,
                near_deg=2.1,
                confidence=0.9,
            )
        ]
        return response

    stitching.create_service(CalibrateOverlap, 'calibrate_overlap', calibrate)
    ros.start(stitching, node)
    words = (
        'left and right overlap, 140.2° apart, near things up to 2.1° beside far ones '
        '(confidence 0.90)' + '; saved' * save
    )
    wait_for(lambda: press_calibrate(node) == (200, words))


def test_the_button_says_so_where_nobody_measures(ros):
    node = viewer(ros, port=0)
    ros.start(node)
    status, words = press_calibrate(node)
    assert status == 503
    assert 'nobody offers calibrate_overlap' in words


def test_a_bug_in_the_page_stands_in_the_diagnostics_and_the_rest_goes_on(ros, monkeypatch):
    stitching, node = Stitching(ros.context), viewer(ros, port=0)
    stitching.create_service(CalibrateOverlap, 'calibrate_overlap', lambda _, response: response)
    heard = []
    stitching.create_subscription(
        DiagnosticArray, '/diagnostics', lambda message: heard.extend(message.status), 10
    )
    ros.start(stitching, node)
    monkeypatch.setattr(viewer_node, 'CalibrateOverlap', None)
    wait_for(lambda: press_calibrate(node)[0] == 500)
    wait_for(lambda: any(s.name == 'rig/viewer' and s.level == b'\2' for s in heard))
    told = next(s.message for s in heard if s.name == 'rig/viewer' and s.level == b'\2')
    assert told.startswith('a part of the page failed: AttributeError in viewer_node.py')
    assert look(node) == JPEG


def test_the_bit_rate_is_live_within_its_range(ros):
    node = viewer(ros, port=0)
    ros.start(node)
    for kbps, is_taken in ((500, True), (10, False)):
        (result,) = node.set_parameters([Parameter('video_bitrate_kbps', value=kbps)])
        assert result.successful == is_taken
    assert 'Min: 100, Max: 100000' in result.reason


def test_a_port_that_cannot_be_had_is_a_sentence(ros):
    first = viewer(ros, port=0)
    ros.start(first)
    port = int(first.url.split(':')[2].strip('/'))
    with pytest.raises(SettingError, match='in use by another program'):
        viewer(ros, port=port)
