"""What reads the frames of the panorama node: one reader a source, for all its cameras."""

import os
import re
from abc import ABC, abstractmethod
from collections.abc import Callable

from fisheye_bridge.diagnostics import ERROR, WARN, Report
from fisheye_bridge.stamps import ns_of
from fisheye_bridge.topics import ImageSubscription
from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.grabber import Grabber
from fisheye_capture.region import AnyFrame
from fisheye_capture.source import Frame
from fisheye_core.errors import SettingError
from fisheye_geometry.camera import Camera
from panorama_stitch.nodes.base_node import PanoramaBase

TOPIC = 'topic'
"""The source that is no camera of this node: another one publishes the images."""
_OF_SOURCE = 'rtsp_transport', 'stamp_from', 'delay_ms'
"""What cameras that share a source cannot have different."""


class Reader(ABC):
    """Hands each frame of a source to every camera that is in it.

    Attributes
    ----------
    camera
        What the source knows of itself; None for nothing.
    """

    camera: Camera | None = None

    def __init__(self, settings: CaptureSettings):
        self.settings = settings
        self._takers: dict[str, Callable[[AnyFrame, str], None]] = {}

    @property
    def names(self) -> str:
        """The cameras that the source has."""
        return ', '.join(self._takers)

    def add(self, name: str, take: Callable[[AnyFrame, str], None]) -> None:
        """Hand frames to one more camera, with their encoding; `take` must not raise."""
        self._takers[name] = take

    def start(self) -> None:  # noqa: B027
        """Begin to read."""

    def stop(self) -> None:  # noqa: B027
        """Release the source."""

    @abstractmethod
    def report(self, report: Report) -> None:
        """Report what is wrong with the source, and its numbers."""

    def _hand_over(self, frame: AnyFrame, encoding: str) -> None:
        for take in self._takers.values():
            take(frame, encoding)


class SourceReader(Reader):
    """Reads a source of its own in a thread."""

    def __init__(self, node: PanoramaBase, settings: CaptureSettings):
        super().__init__(settings)
        self._node = node
        self._grabber = Grabber(settings, self._take, on_change=self._tell)
        self.camera = self._grabber.camera

    def start(self) -> None:
        """Begin to read."""
        self._grabber.start()

    def stop(self) -> None:
        """Release the source."""
        self._grabber.stop()

    def report(self, report: Report) -> None:
        """Report what is wrong with the source, and its numbers."""
        grabber = self._grabber
        for name in self._takers:
            report.values[f'{name} skipped'] = grabber.skipped
            report.values[f'{name} damaged'] = grabber.damaged
        for level, sentence in (
            (ERROR, grabber.complaint),
            (WARN, grabber.note),
            (WARN, grabber.damage()),
        ):
            if sentence:
                report.add(level, f'{self.names}: {sentence}')

    def _take(self, frame: AnyFrame) -> None:
        self._hand_over(frame, self.settings.encoding)

    def _tell(self, reason: str) -> None:
        news = f'{self.names}: {self._grabber.news(reason)}'
        if reason:
            self._node.warn(news)
        else:
            self._node.get_logger().info(news)


class TopicReader(Reader):
    """Reader of the images of a topic, once for all the cameras that are in them."""

    def __init__(self, node: PanoramaBase, topic: str, settings: CaptureSettings):
        super().__init__(settings)
        self._topic, self._has_come = topic, False
        self._pictures = ImageSubscription(
            node, topic, self._take, transport=node.settings.transport, key=f'{topic} refused'
        )

    def report(self, report: Report) -> None:
        """Report what is wrong with the source, and its numbers."""
        if not self._has_come:
            report.add(ERROR, f'{self.names}: waiting for {self._topic}')
        self._pictures.dropped.tell(report)

    def _take(self, image, encoding, header) -> None:
        self._has_come = True
        self._hand_over(Frame(ns_of(header.stamp), image), encoding)


def reader_for(
    readers: dict[str, Reader], node: PanoramaBase, name: str, own: CaptureSettings
) -> Reader:
    """Return the reader of a camera's source, and note a new one in `readers`.

    Raises
    ------
    SettingError
        If another camera reads the same source in another way.
    SourceError
        If the source can give no frame ever.
    """
    is_topic = own.source == TOPIC
    topic = node.resolve_topic_name(f'{name}/image_raw')
    key = topic if is_topic else _key(name, own.source)
    if reader := readers.get(key):
        for entry in _OF_SOURCE:
            mine, theirs = getattr(own, entry), getattr(reader.settings, entry)
            if mine != theirs:
                raise SettingError(
                    f'{name}.{entry} is {mine}; expected {theirs}, as {reader.names} has it, '
                    'whose source is the same'
                )
        return reader
    readers[key] = TopicReader(node, topic, own) if is_topic else SourceReader(node, own)
    return readers[key]


def _key(name: str, source: str) -> str:
    """Return what is equal for cameras of one source."""
    if source == 'synthetic':
        return f'synthetic {name}'  # each looks elsewhere
    path = f'/dev/video{source}' if re.fullmatch('[0-9]+', source) else source
    path = os.path.expanduser(path.removeprefix('file://'))
    return os.path.realpath(path) if path.startswith('/dev/') or os.path.exists(path) else source
