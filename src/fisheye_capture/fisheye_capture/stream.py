"""Network streams, each read by a process of its own.

FFmpeg cannot be interrupted while it waits for a camera, and it decodes what comes from outside;
a process can be ended at any moment and harms nobody if it fails.
"""

import os
import struct
import subprocess
import sys

import numpy as np

from fisheye_capture.settings import CaptureSettings
from fisheye_capture.source import Frame, Source, SourceLostError

HEADER = struct.Struct('=qIII')
"""Stamp in ns, rows, columns, channels; pixels follow. 0 rows: the end, why in columns bytes."""
_ENVIRONMENT = {
    'OPENCV_FFMPEG_CAPTURE_OPTIONS': 'rtsp_transport;tcp|fflags;nobuffer|flags;low_delay',
    'OPENCV_FFMPEG_LOGLEVEL': '-8',
    'OPENCV_LOG_LEVEL': 'SILENT',
}
"""Newest picture first, and no word from the libraries; what the user set goes before."""


class StreamSource(Source):
    """An http, rtsp or udp stream."""

    def __init__(self, settings: CaptureSettings):
        # Not as arguments: they are for everybody to see, and a URL may hold a password.
        lines = settings.source, settings.encoding, str(settings.frame_rate_hz)
        try:
            self._process = subprocess.Popen(
                [sys.executable, '-m', 'fisheye_capture.stream_reader'],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**_ENVIRONMENT, **os.environ, 'PYTHONPATH': os.pathsep.join(sys.path)},
                # Ctrl-C is for this process, which ends that one.
                start_new_session=True,
            )
            with self._process.stdin as pipe:
                pipe.write('\n'.join(lines).encode())
        except OSError as error:
            raise SourceLostError(f'no process can read the stream: {error.strerror}') from error

    def read(self) -> Frame:
        """Wait for the next frame."""
        header = bytearray(HEADER.size)
        self._fill(header)
        stamp_ns, rows, columns, channels = HEADER.unpack(header)
        if not rows:
            reason = bytearray(columns)
            self._fill(reason)
            raise SourceLostError(reason.decode())
        shape = (rows, columns) if channels == 1 else (rows, columns, channels)
        image = np.empty(shape, np.uint8)
        self._fill(image)
        return Frame(stamp_ns, image)

    def interrupt(self) -> None:
        """End the process, and with it a read that waits."""
        self._process.kill()

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        self._process.stdout.close()

    def _fill(self, buffer):
        view = memoryview(buffer).cast('B')
        if self._process.stdout.readinto(view) != len(view):
            raise SourceLostError('the process that reads the stream ended')
