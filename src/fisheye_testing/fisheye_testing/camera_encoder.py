"""What a network camera shows, coded: H.264 or JPEG, muxed to a URL or a file."""

import time
from collections.abc import Iterator
from fractions import Fraction
from itertools import count
from threading import Event, Thread

import av
import cv2
import numpy as np
from av.video.frame import PictureType

from fisheye_testing.painted_time import paint

CLOCK_HZ = 90_000
_GONE = 5
"""Whoever joins after so many pictures gets nothing of the first one, a keyframe."""


def pictures(width: int, height: int, rate_hz: float) -> Iterator[np.ndarray]:
    """Yield a moving scene (height, width, 3) at a rate, each picture with its time."""
    noise = np.random.default_rng(1).integers(40, 200, (height, 2 * width, 3), np.uint8)
    scene = cv2.GaussianBlur(noise, (0, 0), 5)
    start_s = time.monotonic()
    for number in count():
        time.sleep(max(0.0, start_s + number / rate_hz - time.monotonic()))
        at = number * 4 % width
        image = scene[:, at : at + width].copy()
        paint(image, time.time_ns())
        yield image


class Encoder:
    """Codes pictures and muxes them to a URL or a file; runs in a thread of its own."""

    def __init__(self, url: str, container: str, options: dict[str, str], arguments, relay=None):
        self._output = av.open(url, 'w', format=container, options=options)
        codec = {'h264': 'libx264', 'mjpeg': 'mjpeg'}[arguments.codec]
        stream = self._output.add_stream(codec, rate=round(arguments.rate))
        stream.width, stream.height = arguments.width, arguments.height
        stream.pix_fmt = 'yuvj420p' if arguments.codec == 'mjpeg' else 'yuv420p'
        stream.codec_context.time_base = Fraction(1, CLOCK_HZ)
        stream.bit_rate = 8_000_000
        gop = max(1, round(arguments.gop * arguments.rate))
        if codec == 'libx264':
            stream.options = {
                'preset': 'ultrafast',
                'tune': 'zerolatency',
                'x264-params': f'keyint={gop}:min-keyint={gop}:scenecut=0:repeat-headers=1'
                ':bframes=0:slices=1:sliced-threads=0',
            }
        if arguments.codec == 'mjpeg':
            stream.options = {'huffman': 'default', 'force_duplicated_matrix': '1'}
        stream.codec_context.thread_count = 1
        self._stream, self._arguments, self._relay = stream, arguments, relay
        self._is_running = Event()
        Thread(target=self._run, daemon=True).start()
        if arguments.join_late:
            self._is_running.wait()

    def _run(self):
        arguments = self._arguments
        # A sender report takes the time of the header for that of the stream's beginning.
        self._output.start_encoding()
        start_ns = time.time_ns()
        for number, image in enumerate(
            pictures(arguments.width, arguments.height, arguments.rate)
        ):
            if number == _GONE:
                self._is_running.set()
            now_ns = time.time_ns()
            frame = av.VideoFrame.from_ndarray(image, format='bgr24')
            frame.pts = (now_ns - start_ns) * CLOCK_HZ // 10**9
            frame.time_base = Fraction(1, CLOCK_HZ)
            if self._relay and self._relay.has_new and not arguments.join_late:
                # As cameras do it: who comes anew is sent a keyframe.
                self._relay.has_new, frame.pict_type = False, PictureType.I
            for packet in self._stream.encode(frame):
                self._output.mux(packet)
