"""The viewer node in this process, with a node beside it in the place of the stitching."""

import json
import time
from math import nan, tau

import aiohttp
import pytest
from fisheye_msgs.msg import Overlap, Overlaps, Projection
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from stitching import DEADLINE_S, JPEG, Stitching, look, viewer, visit

from fisheye_bridge.stamps import stamp_of
from fisheye_core.errors import SettingError
from fisheye_testing.waiting import wait_for


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
