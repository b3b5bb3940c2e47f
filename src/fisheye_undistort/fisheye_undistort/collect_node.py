"""Collects calibration views from a live image topic."""

import sys

from rclpy.node import Node

from fisheye_bridge.topics import ImageSubscription
from fisheye_bridge.watching import spin_until, watch
from fisheye_core.command_line import show_progress
from fisheye_core.encodings import converted
from fisheye_core.errors import SettingError, SourceError
from fisheye_undistort.detect.live_gathering import LiveGathering
from fisheye_undistort.detect.pictures import NamedPicture, cut

_LONGEST_WAIT_S = 10.0
"""Without a picture for so long there is nobody to wait for."""
_LINE = 120
"""Characters of the progress line."""


class CollectNode(Node):
    """Hands the pictures of a topic to whom gathers their views, and shows how far it has come.

    Attributes
    ----------
    count : int
        Pictures that came.
    error : SettingError or None
        Why no picture can be searched for the target.
    """

    def __init__(self, topic: str, gathering: LiveGathering, half: str = '', **kwargs):
        super().__init__('calibrate_lens', **kwargs)
        self._gathering = gathering
        self._half = half
        self.count = 0
        self.error: SettingError | None = None
        self._subscription = ImageSubscription(self, topic, self._look)

    def _look(self, image, encoding, header):
        self.count += 1
        gray = cut(converted(image, encoding, 'mono8'), self._half)
        try:
            self._gathering.add(NamedPicture(f'picture {self.count}', gray, moving=True))
        except SettingError as error:
            self.error = error
        else:
            show_progress(self._gathering.progress(), _LINE)


def collect(topic: str, gathering: LiveGathering, views: int, half: str = '') -> None:
    """Collect views from a topic until there are enough, until it falls silent or until Ctrl-C.

    Raises
    ------
    SourceError
        If no picture comes.
    SettingError
        If fewer than one view is asked for, the topic's name is not possible, or no picture can
        be searched for the target.
    """
    if views < 1:
        raise SettingError(f'{views} views are to be collected; expected at least 1')

    silent = ''

    def see(node: CollectNode) -> None:
        nonlocal silent
        while len(gathering.collector.views) < views and not silent:
            silent = _wait_for_picture(node, topic)

    watch(see, CollectNode, topic, gathering, half)
    if silent:
        print(f'{silent}; going on with {len(gathering.collector.views)} views', file=sys.stderr)


def _wait_for_picture(node: CollectNode, topic: str) -> str:
    """Wait for the next picture; return a sentence if no more come, '' if one came."""
    before = node.count
    came = spin_until(node, lambda: node.count > before, _LONGEST_WAIT_S)
    if node.error:
        raise node.error
    silent = f'no picture came on {node.resolve_topic_name(topic)} for {_LONGEST_WAIT_S:.0f} s'
    if not node.count:
        raise SourceError(f'{silent}; see `ros2 topic list`')
    return '' if came else silent
