"""Network streams, each read by a process of its own.

FFmpeg cannot be interrupted while it waits for a camera, and it decodes what comes from outside;
a process can be ended at any moment and harms nobody if it fails.
"""

import importlib.util
import math
import os
import re
import socket
import subprocess
import sys
from contextlib import suppress
from dataclasses import asdict
from urllib.parse import quote

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.device import BROKEN_IN_A_ROW, check_size, jpeg_frame
from fisheye_capture.network_request import MAX_DIFFERENCE_NS, StreamRequest
from fisheye_capture.shared_frames import SlotPool, receive, send
from fisheye_capture.source import (
    CREDENTIALS,
    Frame,
    JpegFrame,
    Source,
    SourceLostError,
    shown_source,
)
from fisheye_core.errors import ImageFormatError, SourceError

_NS_PER_MS = 1_000_000


class StreamSource(Source):
    """An http, https, rtsp, rtsps or udp camera."""

    def __init__(self, settings: CaptureSettings):
        if importlib.util.find_spec('av') is None:
            raise SourceError(
                'network cameras are read with PyAV, which is missing here: sudo apt install '
                'python3-av, or pip install av'
            )
        self._name, self._encoding = shown_source(settings.source), settings.encoding
        self._delay_ns = round(settings.delay_ms * _NS_PER_MS)
        self._pool, self._size, self._last_ns, self._torn = SlotPool(), None, 0, 0
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            with theirs:
                self._process = subprocess.Popen(
                    [sys.executable, '-m', 'fisheye_capture.stream_reader', str(theirs.fileno())],
                    stdin=subprocess.DEVNULL,
                    pass_fds=[theirs.fileno()],
                    env={**os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
                    # Ctrl-C is for this process, which ends that one.
                    start_new_session=True,
                )
        except OSError as error:
            self._channel.close()
            raise SourceLostError(f'no process can read the stream: {error.strerror}') from error
        # Not as arguments: they are for everybody to see, and a URL may hold a password.
        send(self._channel, asdict(request_of(settings)))

    def read(self) -> Frame | JpegFrame:
        """Wait for a picture that came after the one before; the newest if there are more."""
        for _ in range(BROKEN_IN_A_ROW):
            message, array = self._fetch()
            stamp_ns = message['stamp_ns'] - self._delay_ns
            # A sender report may set the camera's clock right, but no stamp goes back; only where
            # this machine's clock was set back, stamps follow it.
            if 0 <= self._last_ns - stamp_ns < MAX_DIFFERENCE_NS:
                stamp_ns = self._last_ns + 1
            frame = self._frame(stamp_ns, message['shape'], array)
            self.skipped = message['skipped']
            self.damaged = message['damaged'] + self._torn
            self.note = message['note']
            if frame is not None:
                self._last_ns = stamp_ns
                check_size(self._name, self._size, frame.size)
                self._size = frame.size
                return frame
        raise SourceLostError(f'{self._name} sends only broken pictures')

    def interrupt(self) -> None:
        """End the process, and with it a read that waits."""
        self._process.kill()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._channel.close()

    def _fetch(self):
        slot = self._pool.take()
        with suppress(OSError):  # Why it ended is still to be read.
            send(self._channel, {'slot': slot})
        while True:
            message, files = receive(self._channel)
            if not message:
                raise SourceLostError('the process that reads the stream ended')
            if 'lost' in message:
                raise SourceLostError(message['lost'])
            if 'shape' in message:
                return message, self._pool.array(slot, math.prod(message['shape']), files)
            self.note = message['note']

    def _frame(self, stamp_ns, shape, array):
        """Make a frame of what came; None if it is torn, and counted as that."""
        if len(shape) > 1:
            return Frame(stamp_ns, array.reshape(shape))
        frame = jpeg_frame(stamp_ns, array, self._encoding)
        if frame is None:
            self._torn += 1
            return None
        if self._encoding != 'mono8':
            return frame
        try:
            # In grey its own JPEG would be another picture.
            return Frame(stamp_ns, frame.image)
        except ImageFormatError:
            self._torn += 1
            return None


def request_of(settings: CaptureSettings) -> StreamRequest:
    """Return what to ask for a camera of these settings."""
    scheme, mark, rest = settings.source.partition('://')
    return StreamRequest(
        # FFmpeg knows protocols in small letters only.
        url=_quoted(scheme.lower() + mark + rest),
        shown=shown_source(settings.source),
        encoding=settings.encoding,
        frame_rate_hz=settings.frame_rate_hz,
        rtsp_transport=settings.rtsp_transport,
        connect_timeout_s=settings.connect_timeout_s,
        silence_timeout_s=settings.silence_timeout_s,
        first_picture_timeout_s=settings.first_picture_timeout_s,
        stamp_from=settings.stamp_from,
    )


def _quoted(url):
    """Write a user and password so that no letter in them means something in a URL."""

    def quote_both(match):
        user, mark, password = match['login'].partition(':')
        return match['scheme'] + quote(user, safe='%') + mark + quote(password, safe='%') + '@'

    return re.sub(CREDENTIALS, quote_both, url, count=1)
