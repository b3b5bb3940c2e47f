"""Topics that a command watches: an end by Ctrl-C, and names that are not possible."""

import pytest
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Image

from fisheye_bridge.qos import IMAGE
from fisheye_bridge.watching import watch
from fisheye_core.errors import SettingError


class TopicWatcher(Node):
    def __init__(self, topic):
        super().__init__('watcher')
        self.create_subscription(Image, topic, lambda message: None, IMAGE)


def test_ctrl_c_ends_it_and_leaves_what_was_seen():
    seen = []

    def see(node):
        seen.append(node.get_name())
        raise KeyboardInterrupt

    watch(see, TopicWatcher, '/watching_test/image')
    assert seen == ['watcher']
    assert not rclpy.ok()


def test_a_name_that_no_topic_has_is_told():
    with pytest.raises(SettingError, match=r"^the topic '/no topic' is not possible: .*[^:]$"):
        watch(lambda node: None, TopicWatcher, '/no topic')
    assert not rclpy.ok()


def test_an_environment_that_ros_refuses_is_a_sentence(monkeypatch):
    monkeypatch.setenv('ROS_DOMAIN_ID', 'abc')
    with pytest.raises(SettingError, match='ROS_DOMAIN_ID is not an integral number'):
        watch(lambda node: None, TopicWatcher, '/watching_test/image')
    assert not rclpy.ok()
