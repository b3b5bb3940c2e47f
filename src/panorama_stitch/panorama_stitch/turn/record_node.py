"""Watches the topics of a rig's cameras while it turns."""

from collections.abc import Mapping

import numpy as np
from rclpy.node import Node

from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_bridge.watching import spin_until, watch
from fisheye_core.command_line import show_progress
from fisheye_core.encodings import converted
from fisheye_core.errors import FisheyeError, SourceError
from panorama_stitch.pipeline.pairing import FramePairing
from panorama_stitch.turn.full_circle import has_come_round
from panorama_stitch.turn.tracker import TurnTracker

_LONGEST_WAIT_S = 10.0
"""Without pictures of all cameras for so long there is nobody to wait for."""
_MAX_SKEW_NS = 50_000_000
_LINE = 100
"""Characters of the progress line."""


class RecordNode(Node):
    """Hands the pictures of all cameras that were taken together to a tracker.

    Attributes
    ----------
    count : int
        Sets of pictures that came.
    error : FisheyeError or None
        What the tracker refused.
    """

    def __init__(self, topics: Mapping[str, str], tracker: TurnTracker, **kwargs):
        super().__init__('calibrate_rig', **kwargs)
        self._tracker = tracker
        self._pairing = FramePairing(tuple(topics), _MAX_SKEW_NS)
        self.count = 0
        self.error: FisheyeError | None = None
        self._inputs = [
            ImageSubscription(self, topic, self._taker(name)) for name, topic in topics.items()
        ]

    def _taker(self, name: str):
        def take(image: np.ndarray, encoding: str, header) -> None:
            gray = np.array(converted(image, encoding, 'mono8'))
            group = self._pairing.add(name, ns_of(header.stamp), gray, gray.nbytes)
            if group and self.error is None:
                self._look([stamped.frame for stamped in group])

        return take

    def _look(self, pictures) -> None:
        self.count += 1
        try:
            self._tracker.add(pictures)
        except FisheyeError as error:
            self.error = error
        kept = len(self._tracker.frames)
        show_progress(f'{self.count} pictures, {kept} kept: go on turning', _LINE)


def record(topics: Mapping[str, str], tracker: TurnTracker) -> None:
    """Watch topics until the rig has come round, or until Ctrl-C.

    Parameters
    ----------
    topics
        Image topics by the names of the cameras.
    tracker
        Is given the pictures.

    Raises
    ------
    SourceError
        If no pictures come that were taken together.
    SettingError
        If a topic's name is not possible.
    FisheyeError
        What the tracker raises.
    """

    def see(node: RecordNode) -> None:
        while not has_come_round(tracker.frames):
            _wait_for_pictures(node, topics)

    watch(see, RecordNode, topics, tracker)


def _wait_for_pictures(node: RecordNode, topics: Mapping[str, str]) -> None:
    before = node.count
    came = spin_until(node, lambda: node.count > before or bool(node.error), _LONGEST_WAIT_S)
    if node.error:
        raise node.error
    if not came:
        raise SourceError(
            f'no pictures that were taken together came on {", ".join(topics.values())} for '
            f'{_LONGEST_WAIT_S:.0f} s; see `ros2 topic hz` of each'
        )
