"""Saves one panorama: the command `snapshot`."""

import argparse
from math import inf
from pathlib import Path

import numpy as np
from fisheye_msgs.msg import Projection
from rclpy.node import Node

from fisheye_bridge.command_line import own_words
from fisheye_bridge.projection import surface_of
from fisheye_bridge.qos import LATCHED_INPUT
from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_bridge.watching import spin_until, started
from fisheye_core.command_line import exit_code
from fisheye_core.encodings import to_opencv
from fisheye_core.errors import SettingError, SourceError
from fisheye_geometry.surface import Surface
from panorama_viewer.projection import Quaternion, StateHistory, turned
from panorama_viewer.snapshot import FORMATS, save

Taken = tuple[np.ndarray, Surface, int, bool, Quaternion | None]


class SnapshotNode(Node):
    """Waits for a panorama and for the projection that belongs to it.

    Attributes
    ----------
    taken : tuple or None
        Image (height, width[, 3]) uint8, BGR or grey; its surface; its stamp, ns; whether its
        edges meet; what takes it to the level, None if it is level.
    """

    def __init__(self, **kwargs):
        super().__init__('snapshot', **kwargs)
        self.taken: Taken | None = None
        self._missing = 'panorama', 'panorama/image'
        self._projections: StateHistory[Projection] = StateHistory()
        self.create_subscription(Projection, 'panorama/projection', self._place, LATCHED_INPUT)
        self._image = ImageSubscription(self, 'panorama/image', self._take)

    def _place(self, message) -> None:
        self._projections.add(ns_of(message.header.stamp), message)

    def _take(self, image, encoding, header) -> None:
        self._missing = 'projection of the panorama', 'panorama/projection'
        stamp_ns = ns_of(header.stamp)
        projection = self._projections.at(stamp_ns)
        if projection is None:
            return
        surface, q = surface_of(projection), projection.orientation
        # Behind a new projection there may still be a picture of the old one.
        if image.shape[1::-1] == (surface.width, surface.height):
            picture, level = to_opencv(image, encoding), turned(q.x, q.y, q.z, q.w)
            self.taken = picture, surface, stamp_ns, projection.wraps, level

    def wait(self, timeout_s: float) -> Taken:
        """Spin until a panorama was taken; a `SourceError` if none comes."""
        spin_until(self, lambda: self.taken is not None, timeout_s)
        if self.taken is None:
            what, name = self._missing
            topic = self.resolve_topic_name(name)
            raise SourceError(f'no {what} came on {topic} within {timeout_s:g} s')
        return self.taken


def seconds(text: str) -> float:
    """Read a time of the command line."""
    if not 0 <= (value := float(text)) < inf:
        raise argparse.ArgumentTypeError(f'{text} is not a time; expected seconds from 0')
    return value


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(prog='snapshot', description='Save one panorama.')
    parser.add_argument(
        '--format',
        choices=FORMATS,
        default='png',
        help='png: as it is, with its projection in a JSON file beside it; '
        'gpano: equirectangular JPEG that viewers of photo spheres read',
    )
    parser.add_argument(
        '--out', type=Path, default=Path('panorama'), help='the file to write, or its folder'
    )
    parser.add_argument('--timeout', type=seconds, default=10.0, help='how long to wait, s')
    try:
        return parser.parse_args(own_words())
    except SettingError as error:
        parser.error(str(error))


def main() -> int:
    """Save a panorama and say where."""
    arguments = parse()
    return exit_code('snapshot', lambda: _run(arguments))


def _run(arguments: argparse.Namespace) -> int:
    with started(SnapshotNode) as node:
        taken = node.wait(arguments.timeout)
    for path in save(arguments.out, arguments.format, *taken):
        print(f'Saved {path}')
    return 0
