"""Video between two nodes: only while it is wanted, from the first moment on, and mended."""

import time
from array import array
from threading import Event
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from sensor_msgs.msg import CameraInfo, CompressedImage
from std_msgs.msg import Header

from fisheye_bridge import video_publisher
from fisheye_bridge.camera_topics import CameraSubscription
from fisheye_bridge.diagnostics import OK, WARN, Report
from fisheye_bridge.qos import IMAGE, VIDEO, VIDEO_INPUT
from fisheye_bridge.stamps import ns_of, stamp_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_bridge.video_input import VideoInput
from fisheye_bridge.video_publisher import VideoPublisher
from fisheye_core import planar_picture
from fisheye_core.errors import VideoError
from fisheye_core.h264_encoder import H264Encoder
from fisheye_core.nal_units import is_keyframe
from fisheye_core.video_settings import VideoSettings
from fisheye_testing.waiting import PATIENCE_S, wait_for

SETTINGS = VideoSettings(video_keyframe_s=60.0, video_encoder='libx264')
"""No keyframe comes by itself."""
SIZE = 160, 120
SOON = 8
"""Pictures: what passes until a new subscriber and the publisher have found each other."""
CLOSE = 6.0
FUZZED = 1000
CALLBACKS = 6
"""For one picture: so many subscribers and requests, and more."""


class VideoLink:
    """A publisher of video and who else is there, spun by `step`."""

    def __init__(self):
        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self.robot, self.base = (
            rclpy.create_node(name, context=self._context, use_global_arguments=False)
            for name in ('robot', 'base')
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        for node in (self.robot, self.base):
            self._executor.add_node(node)
        self.video = VideoPublisher(self.robot, 'image_raw', 'image_raw/video')
        self.sent = 0

    def stop(self):
        self.video.stop()
        for node in (self.robot, self.base):
            node.destroy_node()
        self._executor.shutdown()
        rclpy.shutdown(context=self._context)

    def subscribe(self, take):
        """Subscribe to the messages as they are."""
        return self.base.create_subscription(
            CompressedImage, 'image_raw/video/compressed', take, VIDEO_INPUT
        )

    def put(self, image=None, settings=SETTINGS):
        """Publish a picture, grey as its number."""
        grey = np.full((SIZE[1], SIZE[0], 3), 30 + self.sent % 200, np.uint8)
        grey = grey if image is None else image
        self.sent += 1
        self.video.put(grey, 'bgr8', Header(stamp=stamp_of(self.sent)), settings)

    def spin(self):
        """Let come what comes."""
        self._executor.spin_once(0.02)
        for _ in range(CALLBACKS):
            self._executor.spin_once(0)
        return True

    def step(self, image=None, settings=SETTINGS):
        """Publish a picture and let come what comes."""
        self.put(image, settings)
        return self.spin()

    def until(self, condition, what):
        wait_for(lambda: self.step() and condition(), PATIENCE_S, what)

    def report(self):
        report = Report()
        self.video.report(report)
        return report


@pytest.fixture
def link():
    link = VideoLink()
    yield link
    link.stop()


def test_it_is_wanted_while_somebody_subscribes(link):
    assert not link.video.wanted
    subscription = link.subscribe(lambda message: None)
    wait_for(lambda: link.video.wanted, what='a subscriber')
    link.base.destroy_subscription(subscription)
    wait_for(lambda: not link.video.wanted, what='the end of the subscription')
    assert link.report().values == {}


def test_who_joins_gets_a_keyframe_though_none_was_due(link):
    first, later = [], []
    link.subscribe(first.append)
    link.until(lambda: len(first) > 40, 'video')
    link.subscribe(later.append)
    link.until(lambda: len(later) > SOON, 'video for the other')
    for messages in (first, later):
        assert any(is_keyframe(bytes(m.data)) for m in messages[:SOON])
    assert sum(is_keyframe(bytes(m.data)) for m in first) < len(first) / 4
    assert {m.format for m in first} == {'h264'}


def test_who_leaves_and_comes_again_at_once_is_a_new_subscriber(link):
    """One is gone and another is there before anybody looked: the number of them is the same."""
    first, later = [], []
    subscription = link.subscribe(first.append)
    link.until(lambda: len(first) > 40, 'video')
    link.base.destroy_subscription(subscription)
    link.subscribe(later.append)
    link.until(lambda: len(later) > SOON, 'video again')
    assert any(is_keyframe(bytes(m.data)) for m in later[:SOON])


def test_pictures_come_out_with_the_stamp_that_they_went_in_with(link):
    pictures = []
    ImageSubscription(
        link.base,
        'image_raw',
        lambda image, encoding, header: pictures.append((image, encoding, ns_of(header.stamp))),
        transport='video',
    )
    link.until(lambda: len(pictures) > 20, 'pictures')
    for image, encoding, stamp_ns in pictures:
        assert encoding == 'bgr8'
        assert image.shape == (SIZE[1], SIZE[0], 3)
        assert abs(image.mean() - (29 + stamp_ns % 200)) < CLOSE
    values = link.report().values
    assert values['video encoder'] == 'libx264'
    assert values['video kbit/s'] > 0


def test_a_gap_is_told_and_mended_by_a_keyframe_that_is_asked_for(link):
    """What comes from somewhere else breaks the stream: here it stands for a loss on the way."""
    pictures = []
    base = ImageSubscription(
        link.base, 'image_raw', lambda *picture: pictures.append(picture), transport='video'
    )
    intruder = link.robot.create_publisher(CompressedImage, 'image_raw/video/compressed', VIDEO)
    link.until(lambda: len(pictures) > 5, 'pictures')
    intruder.publish(CompressedImage(format='h264', data=array('B', b'\0\0\1\x41broken')))
    link.until(lambda: base.dropped.count, 'the loss')
    report = Report()
    base.dropped.tell(report)
    assert report.level == WARN
    assert 'expected is a keyframe now, which is asked for' in report.reasons[0]
    before = len(pictures)
    link.until(lambda: len(pictures) > before + 5, 'pictures again')


def test_a_slow_encoder_drops_pictures_and_keeps_nobody_waiting(link, monkeypatch):
    came, count, goes_on = [], 12, Event()
    encode = H264Encoder.encode

    def encode_when_told(*arguments):
        goes_on.wait()
        return encode(*arguments)

    monkeypatch.setattr(H264Encoder, 'encode', encode_when_told)
    goes_on.set()
    link.subscribe(came.append)
    link.until(lambda: came, 'video')
    goes_on.clear()
    skipped = link.report().values['video pictures skipped']
    for _ in range(count):
        link.put()
    goes_on.set()
    wait_for(lambda: link.spin() and ns_of(came[-1].header.stamp) == link.sent, what='the latest')
    skipped = link.report().values['video pictures skipped'] - skipped
    assert count - 2 <= skipped <= count, 'all but the one that is encoded and the latest'


def test_a_fault_of_the_encoder_is_told_and_harms_nothing_else(link, monkeypatch):
    def fail(settings):
        raise VideoError('video needs PyAV, which is missing here')

    monkeypatch.setattr(video_publisher, 'video_encoder', fail)
    link.subscribe(lambda message: None)
    link.until(lambda: link.report().level == WARN, 'a warning')
    assert link.report().reasons == ['image_raw/video: video needs PyAV, which is missing here']
    assert link.report().values['video encoder'] == 'none'


def test_a_bug_of_the_encoder_is_told_and_harms_nothing_else(link, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(H264Encoder, 'encode', Mock(side_effect=ValueError('no such thing')))
        link.subscribe(lambda message: None)
        link.until(lambda: link.report().level == WARN, 'a warning')
        (reason,) = link.report().reasons
        assert 'a bug, ValueError: no such thing' in reason
    link.until(lambda: link.report().level == OK, 'video')


def test_pictures_that_waited_for_their_turn_are_shown(link):
    encoder, stamps_ns = H264Encoder(bitrate_kbps=2000, keyframe_s=60.0, encoder='libx264'), []
    video = VideoInput(link.base, 'image_raw/video')
    for number in range(60):
        stamps_ns.append(number * 33_000_000)
        encoded = encoder.encode(np.full((120, 160, 3), 4 * number, np.uint8), now_s=number / 30)
        header = Header(stamp=stamp_of(stamps_ns[-1]))
        if number == 40:
            time.sleep(0.2)  # ten times what those before took, which came at once
        assert video(CompressedImage(header=header, data=encoded.data)), number


def test_grey_pictures_are_video_too(link):
    pictures = []
    ImageSubscription(
        link.base, 'image_raw', lambda *picture: pictures.append(picture), transport='video'
    )
    grey = np.full((SIZE[1], SIZE[0]), 77, np.uint8)

    def step():
        link.video.put(grey, 'mono8', Header(), SETTINGS)
        link.step()
        return any(abs(cv2.mean(image)[0] - 77) < CLOSE for image, *_ in pictures)

    wait_for(step, what='a grey picture')


@pytest.mark.parametrize('is_too_large', [False, True])
def test_pictures_come_as_their_camera_info_describes_them(link, monkeypatch, is_too_large):
    width, height, pictures, lenses = 161, 119, [], []
    shown = width, height
    if is_too_large:
        monkeypatch.setattr(planar_picture, 'MAX_MACROBLOCKS', 40)
        shown = 80, 59
    CameraSubscription(
        link.base,
        on_picture=lambda image, *_: pictures.append(image.shape[1::-1]),
        on_lens=lambda lens, _: lenses.append(lens),
        check=lambda lens: None,
        transport='video',
    )
    infos = link.robot.create_publisher(CameraInfo, 'camera_info', IMAGE)
    k = [50.0, 0.0, width / 2, 0.0, 50.0, height / 2, 0.0, 0.0, 1.0]
    info = CameraInfo(width=width, height=height, distortion_model='equidistant', k=k, d=[0.0] * 4)
    image = np.full((height, width, 3), 120, np.uint8)

    def step():
        infos.publish(info)
        link.step(image)
        return lenses and pictures[-5:] == [shown] * 5

    wait_for(step, what='pictures of the size of the camera')
    assert (lenses[-1].width, lenses[-1].height) == shown


def test_a_thousand_fuzzed_messages_are_survived_told_and_mended(link):
    pictures, genuine = [], []
    base = ImageSubscription(
        link.base, 'image_raw', lambda *picture: pictures.append(picture), transport='video'
    )
    link.subscribe(genuine.append)
    intruder = link.robot.create_publisher(CompressedImage, 'image_raw/video/compressed', VIDEO)
    link.until(lambda: len(genuine) > 5, 'video to spoil')
    rng = np.random.default_rng(5)
    for _ in range(FUZZED):
        data = bytearray(genuine[rng.integers(len(genuine))].data)
        for at in rng.integers(len(data), size=rng.integers(1, 50)):
            data[at] = rng.integers(256)
        del data[rng.integers(1, len(data) + 1) :]
        intruder.publish(CompressedImage(format='h264', data=array('B', bytes(data))))
        link.step()
    assert base.dropped.count > 0
    before = len(pictures)
    link.until(lambda: len(pictures) > before + 5, 'pictures again')
