"""What the process that reads a network camera is asked for."""

import re
from dataclasses import dataclass
from urllib.parse import quote

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.source import CREDENTIALS, shown_source

SCHEMES = ('http', 'https', 'rtsp', 'rtsps', 'udp')


@dataclass(frozen=True)
class StreamRequest:
    """A network camera and how it is to be read.

    Attributes
    ----------
    url, shown
        Its address, and the same as others may read it.
    """

    url: str
    shown: str
    encoding: str
    frame_rate_hz: float
    rtsp_transport: str
    connect_timeout_s: float
    silence_timeout_s: float
    first_picture_timeout_s: float
    stamp_from: str

    @classmethod
    def of(cls, settings: CaptureSettings) -> 'StreamRequest':
        """Return what to ask for a camera of these settings."""
        return cls(
            url=_quoted(settings.source),
            shown=shown_source(settings.source),
            encoding=settings.encoding,
            frame_rate_hz=settings.frame_rate_hz,
            rtsp_transport=settings.rtsp_transport,
            connect_timeout_s=settings.connect_timeout_s,
            silence_timeout_s=settings.silence_timeout_s,
            first_picture_timeout_s=settings.first_picture_timeout_s,
            stamp_from=settings.stamp_from,
        )

    @property
    def scheme(self) -> str:
        """Of the URL, in small letters."""
        return self.url.partition('://')[0].lower()


def _quoted(url):
    """Write a user and password so that no letter in them means something in a URL."""

    def quote_both(match):
        user, mark, password = match['login'].partition(':')
        return match['scheme'] + quote(user, safe='%') + mark + quote(password, safe='%') + '@'

    return re.sub(CREDENTIALS, quote_both, url, count=1)
