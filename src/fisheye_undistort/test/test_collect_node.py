import threading

import pytest
import rclpy
from sensor_msgs.msg import Image
from std_msgs.msg import Header

from fisheye_bridge.qos import IMAGE
from fisheye_core.errors import SettingError, SourceError
from fisheye_testing.image_message import to_message
from fisheye_undistort import collect_node
from fisheye_undistort.collect_node import collect
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.live_gathering import LiveGathering
from fisheye_undistort.target.target import STANDARD

VIEWS = 4
TOPIC = '/collect_node_test/image_raw'


@pytest.fixture
def waving(paper_pictures):
    """Publish each photograph until the next comes, as somebody who waves a sheet."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = rclpy.create_node('waving', context=context)
    publisher = node.create_publisher(Image, TOPIC, IMAGE)
    ended = threading.Event()

    def wave():
        look = 0
        while not ended.wait(0.03):
            picture = paper_pictures[look // 8 % len(paper_pictures)]
            publisher.publish(to_message(picture, 'mono8', Header()))
            look += 1

    thread = threading.Thread(target=wave)
    thread.start()
    yield
    ended.set()
    thread.join()
    node.destroy_node()
    rclpy.shutdown(context=context)


def test_views_are_collected_from_a_topic(waving, capsys):
    gathering = LiveGathering(Detector(STANDARD['circles']))
    collect(TOPIC, gathering, VIEWS)
    collector = gathering.gathered().collector
    assert len(collector.finish()) == VIEWS
    assert collector.size == (640, 480)
    told = capsys.readouterr().err
    assert f'{VIEWS} views' in told
    assert 'of the picture covered' in told


def test_nobody_publishes(monkeypatch):
    monkeypatch.setattr(collect_node, '_LONGEST_WAIT_S', 0.3)
    with pytest.raises(SourceError, match='no picture came on /collect_node_test/nobody'):
        collect('/collect_node_test/nobody', LiveGathering(Detector(STANDARD['circles'])), VIEWS)


@pytest.mark.parametrize(
    ('topic', 'views', 'told'), [('/not a topic', 1, 'not a topic'), (TOPIC, 0, '0 views')]
)
def test_what_cannot_be_collected(topic, views, told):
    with pytest.raises(SettingError, match=told):
        collect(topic, LiveGathering(Detector(STANDARD['circles'])), views)
