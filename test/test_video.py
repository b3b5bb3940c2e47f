"""The panorama and the cameras as video: real processes, other message types, recordings."""

import json
import sys
from pathlib import Path

import cv2
import pytest
from rcl_interfaces.msg import Parameter, ParameterType, ParameterValue
from rcl_interfaces.srv import SetParameters
from rclpy.qos import QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Reader, Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import CompressedImage, Image

from fisheye_bridge.qos import IMAGE_INPUT, VIDEO
from fisheye_bridge.stamps import ns_of
from fisheye_core.nal_units import is_keyframe
from fisheye_core.video import video_decoder
from fisheye_testing.domains import unused_domain
from fisheye_testing.image_message import to_array
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

ROOT = Path(__file__).parents[1]
START_S = 40.0
PATIENT_INPUT = QoSProfile(depth=300)
"""Loses nothing while a busy machine pauses: what follows a lost picture cannot be decoded."""
TOPIC = 'panorama/video/compressed'
SAME_DB = 30.0
"""With the panorama of any other stamp it is less: the scene moves."""
SOON = 8
"""Pictures: what passes until a new subscriber and the node have found each other."""
COUNT = 30
LOW_KBPS = 200
CAP_EXCESS = 1.5
"""Of the cap: what comes is counted over few seconds, and a busy machine delivers in bursts."""


class Taker:
    """Subscriber of a topic through a watcher's node until it is closed; messages by stamp."""

    def __init__(self, watcher, kind=CompressedImage, topic=TOPIC, qos=PATIENT_INPUT):
        self.messages, self._node = {}, watcher.node
        self._subscription = self._node.create_subscription(kind, topic, self._take, qos)

    def close(self):
        """Unsubscribe; once more does nothing."""
        if self._subscription:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def first(self, count):
        """Return the first messages, in order."""
        wait_for(lambda: len(self.messages) >= count, START_S, f'{count} messages')
        return list(self.messages.values())[:count]

    def _take(self, message):
        self.messages[ns_of(message.header.stamp)] = message


@pytest.fixture(scope='module')
def running(tmp_path_factory):
    """Run the panorama node on synthetic cameras; no keyframe comes of its own accord."""
    domain = unused_domain()
    log = tmp_path_factory.mktemp('log')
    with Watcher(domain) as watcher, RigProcesses(domain, log) as rig:
        rig.start('panorama', width=640, height=480, video_keyframe_s=60.0)
        wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'an overlap')
        yield rig, watcher


@pytest.fixture
def panorama(running):
    """Return who watches it."""
    return running[1]


@pytest.fixture
def take(panorama):
    """Return what makes a `Taker`, which takes until the test ends or it is closed."""
    takers = []

    def make(*kind):
        takers.append(Taker(panorama, *kind))
        return takers[-1]

    yield make
    for taker in takers:
        taker.close()


def decoded(messages, encoding='mono8'):
    """Decode messages of video; the pictures by their stamps, while they follow each other."""
    decoder = video_decoder()
    pictures = {
        ns_of(m.header.stamp): decoder.decode(bytes(m.data), encoding, number / 30)
        for number, m in enumerate(messages)
    }
    return {stamp_ns: image for stamp_ns, image in pictures.items() if image is not None}


def test_the_video_is_the_panorama_of_its_stamp(take):
    raw, video = take(Image, 'panorama/image', IMAGE_INPUT), take()
    video.first(COUNT)
    both = wait_for(
        lambda: [
            (cv2.cvtColor(to_array(raw.messages[stamp_ns]), cv2.COLOR_BGR2GRAY), image)
            for stamp_ns, image in decoded([*video.messages.values()]).items()
            if stamp_ns in raw.messages
        ][COUNT // 2 :],
        START_S,
        'pictures of both kinds',
    )
    for picture, image in both:
        height, width = picture.shape
        assert image.shape == (height + height % 2, width + width % 2)
        assert cv2.PSNR(image[:height, :width], picture) > SAME_DB


def test_who_joins_late_begins_within_a_few_pictures(panorama, take):
    early = take()
    early.first(COUNT)
    late = take()
    assert any(is_keyframe(bytes(m.data)) for m in late.first(SOON))
    assert len(decoded(late.first(COUNT))) > COUNT - SOON
    early.close()
    late.close()
    wait_for(lambda: not panorama.node.get_subscriptions_info_by_topic(f'/{TOPIC}'), START_S)


def test_the_bit_rate_changes_live(panorama, take):
    video = take()
    video.first(COUNT)
    client = panorama.node.create_client(SetParameters, 'panorama/set_parameters')
    assert client.wait_for_service(START_S)
    value = ParameterValue(type=ParameterType.PARAMETER_INTEGER, integer_value=LOW_KBPS)
    answer = client.call_async(
        SetParameters.Request(parameters=[Parameter(name='video_bitrate_kbps', value=value)])
    )
    wait_for(answer.done, START_S, 'the answer')
    assert answer.result().results[0].successful
    answered_ns = panorama.node.get_clock().now().nanoseconds

    def settled():
        # Pictures of the old bit rate may still be on their way.
        return sorted(ns for ns in video.messages.copy() if ns > answered_ns)[SOON:]

    wait_for(lambda: len(settled()) >= 3 * COUNT, START_S, 'pictures of the new bit rate')
    taken = settled()
    kbits = sum(8e-3 * len(video.messages[stamp_ns].data) for stamp_ns in taken)
    assert kbits / ((taken[-1] - taken[0]) * 1e-9) < CAP_EXCESS * LOW_KBPS


def test_a_recording_of_the_video_is_played_back(running, take, tmp_path):
    """As `ros2 bag record` writes it; played from its middle it begins at a keyframe."""
    rig, panorama = running
    video, typestore = take(), get_typestore(Stores.ROS2_JAZZY)
    video.first(COUNT)
    middle = take()
    middle.first(COUNT)
    video.close()
    middle.close()
    recorded = dict(video.messages)
    with Writer(tmp_path / 'drive', version=9) as bag:
        connection = bag.add_connection(
            f'/{TOPIC}', 'sensor_msgs/msg/CompressedImage', typestore=typestore
        )
        for stamp_ns, message in recorded.items():
            bag.write(connection, stamp_ns, serialize_message(message))
    with Reader(tmp_path / 'drive') as bag:
        played = [deserialize_message(data, CompressedImage) for *_, data in bag.messages()]
    assert [m.data for m in played] == [m.data for m in recorded.values()]
    assert len(decoded(played)) > COUNT // 2  # a busy machine may lose some
    assert 0 < len(decoded(played[COUNT // 2 :])) < len(played) - COUNT // 2
    picture = tmp_path / 'picture.png'
    program = [sys.executable, str(ROOT / 'examples' / 'take_video.py'), str(picture)]
    rig.run('client', [*program, '--ros-args', '-r', f'{TOPIC}:=played'])
    publisher = panorama.node.create_publisher(CompressedImage, 'played', VIDEO)
    wait_for(publisher.get_subscription_count, START_S, 'the client')

    def play():
        for message in played:
            publisher.publish(message)
        return rig.processes['client'].poll() is not None

    wait_for(play, START_S, 'the picture')
    first = next(iter(decoded(played, 'bgr8').values()))
    assert cv2.imread(str(picture)).shape == first.shape


def test_foxglove_and_image_transport_get_messages_of_theirs_where_they_are_installed(
    domain, interfaces, tmp_path
):
    with RigProcesses(domain, tmp_path / 'log', interfaces) as rig:
        rig.start('panorama', width=640, height=480)
        program = [sys.executable, str(ROOT / 'test' / 'video_client.py')]
        rig.run('client', [*program, str(tmp_path / 'taken.json')])
        wait_for(lambda: rig.processes['client'].poll() is not None, START_S, 'the messages')
        assert rig.processes['client'].returncode == 0, rig.log('client').read_text()
    taken = json.loads((tmp_path / 'taken.json').read_text())
    compressed, foxglove, packets = (
        {int(stamp_ns): message for stamp_ns, message in taken[topic].items()}
        for topic in (TOPIC, 'panorama/video', 'panorama/image/ffmpeg')
    )
    for stamp_ns in set(compressed) & set(foxglove) & set(packets):
        ours, packet = compressed[stamp_ns], packets[stamp_ns]
        assert ours['data'] == foxglove[stamp_ns]['data'] == packet['data']
        assert foxglove[stamp_ns]['format'] == 'h264'
        assert foxglove[stamp_ns]['frame_id'] == 'panorama_optical_frame'
        assert packet['encoding'] == 'h264;yuv420p;bgr8;bgr8'
        assert packet['flags'] == ours['is_keyframe']
        assert packet['pts'] == stamp_ns
        image = video_decoder().decode(bytes.fromhex(ours['data']))
        if image is not None:
            even = packet['height'] + packet['height'] % 2, packet['width'] + packet['width'] % 2
            assert image.shape[:2] == even
    assert any(message['is_keyframe'] for message in compressed.values())


def test_without_their_packages_only_ours_is_there(panorama):
    names = dict(panorama.node.get_topic_names_and_types())
    assert names[f'/{TOPIC}'] == ['sensor_msgs/msg/CompressedImage']
    assert '/panorama/video' not in names
    assert '/panorama/image/ffmpeg' not in names
