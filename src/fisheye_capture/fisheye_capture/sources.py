"""The kinds of sources, and which of them a name means."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.device import DeviceSource
from fisheye_capture.files import (
    PictureSource,
    SequenceSource,
    folder_pictures,
    video_pictures,
)
from fisheye_capture.network_request import SCHEMES
from fisheye_capture.source import Source, shown_source
from fisheye_capture.stream import StreamSource
from fisheye_capture.synthetic import SyntheticSource
from fisheye_core.errors import SourceError
from fisheye_core.picture_file import is_picture, pictures_in


class SourceKind(NamedTuple):
    """One kind of source.

    Attributes
    ----------
    recognises
        Whether a name means a source of this kind.
    open
        Opens what `settings.source` names; raises a `SourceError`.
    """

    recognises: Callable[[str], bool]
    open: Callable[[CaptureSettings], Source]


def kind_of(name: str) -> str:
    """Return which of `SOURCES` a name means: the first one that recognises it.

    Raises
    ------
    SourceError
        If the name means nothing.
    """
    for kind, source in SOURCES.items():
        if source.recognises(name):
            return kind
    scheme, mark, _ = name.partition('://')
    if mark and scheme != 'file':
        raise SourceError(
            f"source '{shown_source(name)}' has the scheme '{scheme}'; expected one of "
            f'{", ".join(SCHEMES)} or file'
        )
    if os.path.exists(_path(name)):
        raise SourceError(
            f'{_path(name)} is not a regular file; expected a picture, a video or a folder'
        )
    raise SourceError(
        f"source '{shown_source(name)}' is not there; expected synthetic, a device, "
        'a picture, a folder or glob of pictures, a video, or an http, rtsp or udp URL'
    )


def open_source(settings: CaptureSettings) -> Source:
    """Open what `settings.source` names.

    Raises
    ------
    SourceLostError
        If a camera is not there; it may come.
    SourceError
        If the name means nothing, or a file cannot be read.
    """
    return SOURCES[kind_of(settings.source)].open(settings)


def _is_device(name: str) -> bool:
    return bool(re.fullmatch('[0-9]+|/dev/.+', name))


def _is_stream(name: str) -> bool:
    scheme, mark, _ = name.partition('://')
    return bool(mark) and scheme.lower() in SCHEMES


def _path(name: str) -> str:
    """Return the path or glob of a name on disk; '' if a URL names something else."""
    scheme, mark, rest = name.partition('://')
    if mark and scheme != 'file':
        return ''
    return os.path.expanduser(rest if mark else name)


def _is_picture(name: str) -> bool:
    return os.path.isfile(_path(name)) and is_picture(_path(name))


def _is_video(name: str) -> bool:
    return os.path.isfile(_path(name)) and not is_picture(_path(name))


def _is_pictures(name: str) -> bool:
    path = _path(name)
    # What exists and is no folder never ends, or is a file.
    return (os.path.isdir(path) or not os.path.exists(path)) and bool(pictures_in(path))


def _open_picture(settings: CaptureSettings) -> Source:
    return PictureSource(settings, Path(_path(settings.source)))


def _open_video(settings: CaptureSettings) -> Source:
    path = Path(_path(settings.source))
    return SequenceSource(settings, lambda: video_pictures(path))


def _open_pictures(settings: CaptureSettings) -> Source:
    paths = pictures_in(_path(settings.source))
    if not paths:
        raise SourceError(
            f"the pictures of '{shown_source(settings.source)}' are not there any more"
        )
    return SequenceSource(settings, lambda: folder_pictures(paths))


SOURCES = {
    'synthetic': SourceKind(lambda name: name == 'synthetic', SyntheticSource),
    'device': SourceKind(_is_device, DeviceSource),
    'stream': SourceKind(_is_stream, StreamSource),
    'picture': SourceKind(_is_picture, _open_picture),
    'video': SourceKind(_is_video, _open_video),
    'pictures': SourceKind(_is_pictures, _open_pictures),
}
"""Kinds of sources by name, in the order in which they are asked."""
