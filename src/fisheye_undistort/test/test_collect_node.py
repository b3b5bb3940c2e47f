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
    """Publish each photograph until the next comes, as somebody who waves a sheet.

    Gives the event that ends it.
    """
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
    yield ended
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


def test_what_was_collected_until_the_camera_stops_is_used(waving, monkeypatch, capsys):
    class Stopping(LiveGathering):
        def add(self, picture):
            super().add(picture)
            if len(self.collector.views) == 2:
                monkeypatch.setattr(collect_node, '_LONGEST_WAIT_S', 2.0)
                waving.set()

    gathering = Stopping(Detector(STANDARD['circles']))
    collect(TOPIC, gathering, 100)
    count = len(gathering.gathered().collector.finish())
    assert count >= 2
    told = f'no picture came on {TOPIC} for 2 s; going on with {count} views\n'
    assert capsys.readouterr().err.endswith(told)


def test_limits_that_no_picture_can_be_searched_with_end_it(waving):
    gathering = LiveGathering(Detector(STANDARD['circles'], 500, 100))
    with pytest.raises(SettingError, match='particles of 500 to 100 px are to be kept'):
        collect(TOPIC, gathering, VIEWS)


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
