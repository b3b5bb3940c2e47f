"""A stranger publishes nonsense on every topic; five nodes go on as if nothing came."""

import os
import time

import numpy as np
import pytest
from field import START_S
from fisheye_msgs.msg import Projection
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from messages import camera_infos, compressed_images, images, projections
from sensor_msgs.msg import CompressedImage, Image

from fisheye_bridge.camera_info import camera_of
from fisheye_bridge.images import from_jpeg
from fisheye_bridge.qos import IMAGE, LATCHED
from fisheye_bridge.stamps import stamp_of
from fisheye_core.errors import FisheyeError
from fisheye_testing.again import TooSlowError, asked_again
from fisheye_testing.health import usage
from fisheye_testing.image_message import to_message
from fisheye_testing.waiting import wait_for
from fisheye_undistort.undistort_settings import UndistortSettings

EXAMPLES, FEW = (1000, 3000) if os.environ.get('LONG') else (200, 50)
TAKEN = 0.9
"""Share of the nonsense that is surely taken: a busy machine may skip some of it."""
TOLD_S = 10.0
"""Within it a node has told of all that it took."""
FLAT_MIB = 5.0
"""What the allocator may still spread over after a while."""


@pytest.fixture
def publish(five):
    """Publish a message on a topic of the five nodes."""
    publishers = {}
    node = five.health.node

    def send(topic, message, qos=IMAGE):
        if topic not in publishers:
            publishers[topic] = node.create_publisher(type(message), topic, qos)
            wait_for(publishers[topic].get_subscription_count, START_S, f'a reader of {topic}')
        publishers[topic].publish(message)

    yield send
    for publisher in publishers.values():
        node.destroy_publisher(publisher)


def until_the_next_panorama(health):
    count = len(health.seen)
    wait_for(lambda: len(health.seen) > count, START_S, 'the next panorama')


def repeated(field, send, strategies, examples):
    """Send examples, each followed by a panorama; memory must not grow from quarter to quarter."""
    quarters = []

    def used():
        return {name: usage(process.pid) for name, process in field.processes.items()}

    @settings(
        max_examples=examples,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    @given(st.tuples(*strategies))
    def one(messages):
        send(*messages)
        until_the_next_panorama(field.health)
        one.count += 1
        if one.count % (examples // 4) == 0:
            quarters.append(used())

    one.count = 0
    one()
    assert len(quarters) == 4
    for name in field.processes:
        # What is loaded once, or kept for a while, makes one step; what is lost grows each time.
        own_mib = [each[name].resident_mib - each[name].shared_mib for each in quarters]
        assert np.diff(own_mib[1:]).min() < FLAT_MIB, f'{name} grew: {np.round(own_mib, 1)} MiB'
        assert np.diff([each[name].files for each in quarters[1:]]).min() <= 0


@asked_again
def test_images(five, publish):
    health = five.health
    refusals = {
        'left/undistort': 'pictures refused',
        'right/undistort': 'pictures refused',
        'stitch': 'left refused',
    }

    def refused():
        return {node: int(health.value(node, key) or 0) for node, key in refusals.items()}

    def send(image, compressed):
        for topic in ('left/image_raw', 'left/image_rect', 'right/image_rect'):
            publish(topic, image)
        publish('right/image_raw/compressed', compressed)

    before = refused()
    what = f'{EXAMPLES} malformed images on each of four topics'
    with five.injured(what):
        repeated(five, send, (images(), compressed_images()), EXAMPLES)
    try:
        wait_for(
            lambda: all(refused()[n] - before[n] >= TAKEN * EXAMPLES for n in refusals),
            TOLD_S,
            f'the refusal of all {EXAMPLES}',
        )
    except TimeoutError as error:
        raise TooSlowError(f'{error}: {refused()}, before {before}') from None


def is_camera(message):
    try:
        UndistortSettings().surface_of(camera_of(message).lens)
    except FisheyeError:
        return False
    return (message.width, message.height) == (640, 480)


@asked_again
def test_camera_infos(five, publish):
    told = []
    listener = five.health.node.create_subscription(
        Projection, 'left/projection', told.append, LATCHED
    )
    wait_for(lambda: told, START_S, 'the projection in use')

    def send(message):
        assume(not is_camera(message))
        for side in ('left', 'right'):
            publish(f'{side}/camera_info', message)

    with five.injured(f'{FEW} malformed camera_info on each side'):
        repeated(five, send, (camera_infos(),), FEW)
    assert len(told) == 1, 'the good calibration stayed in use'
    five.health.node.destroy_subscription(listener)
    log = five.log('left/undistort').read_text()
    assert 'camera_info refused: ' in log
    assert 'the last good calibration stays in use' in log


@asked_again
def test_projections(five, publish):
    def send(message):
        for side in ('left', 'right'):
            publish(f'{side}/projection', message, LATCHED)

    with five.injured(f'{FEW} malformed projections on each side'):
        repeated(five, send, (projections(),), FEW)


@asked_again
def test_stamps(five, publish):
    health = five.health
    good_ns = health.seen[-1].stamp_ns
    stamps = {
        'zero': 0,
        'negative': -5_000_000_000,
        'repeated': good_ns,
        'backwards': good_ns - 3_600_000_000_000,
        'far in the future': (2**31 - 1) * 1_000_000_000,
    }
    picture = cv2_picture(five)
    with five.injured('stamps that are ' + ', '.join(stamps)):
        for stamp_ns in list(stamps.values()) * 3:
            message = to_message(picture, 'bgr8', Image().header)
            message.header.stamp = stamp_of(stamp_ns)
            publish('left/image_raw', message)
            now_ns = time.time_ns()
            wait_for(
                lambda now_ns=now_ns: now_ns <= health.seen[-1].stamp_ns <= time.time_ns(),
                START_S,
                'panoramas of now',
            )


def cv2_picture(field):
    """Return what the left camera sees."""
    message = CompressedImage(format='jpeg')
    message.data.frombytes(field.cameras.pictures['left'])
    return np.ascontiguousarray(from_jpeg(message)[0])
