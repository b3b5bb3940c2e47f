"""Which kind of source a name means."""

import os
import re
from pathlib import Path

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


def open_source(settings: CaptureSettings) -> Source:
    """Open what `settings.source` names.

    Raises
    ------
    SourceLostError
        If a camera is not there; it may come.
    SourceError
        If the name means nothing, or a file cannot be read.
    """
    source = settings.source
    if source == 'synthetic':
        return SyntheticSource(settings)
    if re.fullmatch('[0-9]+|/dev/.+', source):
        return DeviceSource(settings)
    scheme, mark, rest = source.partition('://')
    if mark and scheme.lower() in SCHEMES:
        return StreamSource(settings)
    if mark and scheme != 'file':
        raise SourceError(
            f"source '{shown_source(source)}' has the scheme '{scheme}'; expected one of "
            f'{", ".join(SCHEMES)} or file'
        )
    return _open_files(settings, os.path.expanduser(rest if mark else source))


def _open_files(settings: CaptureSettings, name: str) -> Source:
    if os.path.exists(name) and not os.path.isfile(name) and not os.path.isdir(name):
        raise SourceError(f'{name} is not a regular file; expected a picture, a video or a folder')
    if os.path.isfile(name):
        if is_picture(name):
            return PictureSource(settings, Path(name))
        return SequenceSource(settings, video_pictures(Path(name), settings.loop))
    pictures = pictures_in(name)
    if pictures:
        return SequenceSource(settings, folder_pictures(pictures, settings.loop))
    raise SourceError(
        f"source '{shown_source(settings.source)}' is not there; expected synthetic, a device, "
        'a picture, a folder or glob of pictures, a video, or an http, rtsp or udp URL'
    )
