"""Collects calibration views from a live image topic."""

import sys
import time

import rclpy
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from fisheye_bridge.topics import ImageSubscription
from fisheye_geometry.encodings import converted
from fisheye_geometry.errors import SettingError, SourceError
from fisheye_undistort.collector import Collector
from fisheye_undistort.pictures import Picture, cut

_LONGEST_WAIT_S = 10.0
"""Without a picture for so long there is nobody to wait for."""
_LINE = 120
"""Characters of the progress line."""


class CollectNode(Node):
    """Hands the pictures of a topic to a collector and shows how far it has come."""

    def __init__(self, topic: str, collector: Collector, half: str = '', **kwargs):
        super().__init__('calibrate_lens', **kwargs)
        self._collector = collector
        self._half = half
        self._count = 0
        self.last_s = time.monotonic()
        self._subscription = ImageSubscription(self, topic, self._look)

    def _look(self, image, encoding, header):
        self.last_s = time.monotonic()
        self._count += 1
        gray = cut(converted(image, encoding, 'mono8'), self._half)
        self._collector.add(Picture(f'picture {self._count}', gray, moving=True))
        line = f'{self._collector.progress()}: {self._collector.state or "taken"}'
        print(f'\r{line:{_LINE}.{_LINE}}', end='', file=sys.stderr, flush=True)


def collect(topic: str, collector: Collector, views: int, half: str = '') -> None:
    """Collect views from a topic until there are enough, or until Ctrl-C.

    Raises
    ------
    SourceError
        If no picture comes.
    SettingError
        If fewer than one view is asked for, or the topic's name is not possible.
    """
    if views < 1:
        raise SettingError(f'{views} views are to be collected; expected at least 1')
    # rclpy's own handler would end the context; Ctrl-C only ends the collection.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    node = None
    try:
        node = CollectNode(topic, collector, half)
        while len(collector.views) < views:
            rclpy.spin_once(node, timeout_sec=0.2)
            if time.monotonic() - node.last_s > _LONGEST_WAIT_S:
                raise SourceError(
                    f'no picture came on {node.resolve_topic_name(topic)} for '
                    f'{_LONGEST_WAIT_S:.0f} s; see `ros2 topic list`'
                )
    except InvalidTopicNameException as error:
        reason = str(error).splitlines()[0]
        raise SettingError(f"the topic '{topic}' is not possible: {reason}") from error
    except KeyboardInterrupt:
        pass  # What was collected so far is calibrated.
    finally:
        print(file=sys.stderr)
        if node:
            node.destroy_node()
        rclpy.try_shutdown()
