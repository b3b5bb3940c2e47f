"""The process that reads a network stream for a `StreamSource` and writes its frames to stdout."""

import os
import sys

import cv2

from fisheye_capture.live import LiveSource
from fisheye_capture.source import SourceLostError, shown_source
from fisheye_capture.stream import HEADER
from fisheye_geometry.errors import SourceError

_OPEN_TIMEOUT_S = 10.0
"""RTSP cameras take some seconds until the first picture that stands alone."""
_READ_TIMEOUT_S = 2.0
"""Silence for so long is a lost camera, unless it is a slow one."""
_SLOW_PERIODS = 3


def open_stream(url: str, encoding: str, frame_rate_hz: float) -> LiveSource:
    """Open a stream through OpenCV's FFmpeg.

    Raises
    ------
    SourceLostError
        If nothing answers, or what answers is no stream.
    """
    name = shown_source(url)
    read_timeout_s = max(_READ_TIMEOUT_S, _SLOW_PERIODS / frame_rate_hz)
    limits = {
        cv2.CAP_PROP_OPEN_TIMEOUT_MSEC: _OPEN_TIMEOUT_S,
        cv2.CAP_PROP_READ_TIMEOUT_MSEC: read_timeout_s,
    }
    parameters = [number for prop, s in limits.items() for number in (prop, round(s * 1000))]
    capture = cv2.VideoCapture(url, cv2.CAP_FFMPEG, parameters)
    if not capture.isOpened():
        raise SourceLostError(f'{name} cannot be opened; is it on, and the address right?')
    return LiveSource(name, capture, encoding)


def main() -> None:
    """Read what to open from stdin, then write a header and the pixels of each frame."""
    url, encoding, frame_rate_hz = sys.stdin.read().split('\n')
    # Nothing that a library prints may get between the frames.
    pipe = os.fdopen(os.dup(sys.stdout.fileno()), 'wb')
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    try:
        try:
            source = open_stream(url, encoding, float(frame_rate_hz))
            while True:
                frame = source.read()
                image = frame.image
                channels = 1 if image.ndim == 2 else image.shape[2]
                pipe.write(HEADER.pack(frame.stamp_ns, *image.shape[:2], channels))
                pipe.write(image)
                pipe.flush()
        except SourceError as error:
            reason = str(error).encode()
            pipe.write(HEADER.pack(0, 0, len(reason), 0) + reason)
            pipe.flush()
    except BrokenPipeError:
        # Nobody wants the frames any more; what is left in the buffer cannot be written.
        os._exit(0)


if __name__ == '__main__':
    main()
