"""What a panorama costs on its whole way, stage by stage: from the cameras' JPEGs to the link."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import cycle, islice

import cv2
import numpy as np
from compose import compositor_of
from pairs import real_pairs, synthetic_pair
from timing import Spread, spread
from turning import turning

from fisheye_core.coded_picture import decoded
from fisheye_core.planar_picture import to_planes
from fisheye_core.video import video_decoder, video_encoder
from fisheye_core.video_settings import VideoSettings

RATE_HZ = 30.0
COUNT = 90
_CAMERA_DEG, _PANORAMA_DEG = 170.0, 310.0
_CAMERA_QUALITY, _QUALITY = 90, 80
"""Of a webcam's MJPG, and the default of jpeg_quality."""
_NAME = 'forest'


@dataclass(frozen=True)
class Stage:
    """Processor time of a panorama in one stage, ms, and what leaves it, Mbit/s at 30 Hz."""

    name: str
    cpu_ms: Spread
    mbit_s: float | None = None


def measure_stages() -> list[Stage]:
    """Measure each stage alone, in one thread, on real pictures that turn where they are there."""
    pair = next((pair for pair in real_pairs() if pair.name == _NAME), synthetic_pair(640, 480))
    compositor = compositor_of(pair, 'feather', 'linear', gain=False)
    surface = compositor.layout.surface
    first = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(pair.images, first)
    panoramas = list(turning(first, _PANORAMA_DEG, RATE_HZ, COUNT))
    cameras = list(turning(pair.images[0], _CAMERA_DEG, RATE_HZ, COUNT))
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        return [
            *_before(pair.images, compositor, cameras),
            *_after(panoramas),
        ]
    finally:
        cv2.setNumThreads(threads)


def _before(images, compositor, cameras) -> list[Stage]:
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    jpegs = [_jpeg(camera, _CAMERA_QUALITY) for camera in cameras]
    encoded, packets = _encoding(cameras)
    decoder = video_decoder()
    return [
        Stage(
            'decode the JPEGs of both cameras',
            _cpu_ms(lambda jpeg: (decoded(jpeg), decoded(jpeg)), jpegs),
            2 * _mbit_s(jpegs),
        ),
        Stage('encode both cameras as H.264', _twice(encoded), 2 * _mbit_s(packets)),
        Stage('at the base: decode these', _twice(_cpu_ms(decoder.decode, packets))),
        Stage('compose', _cpu_ms(lambda _: compositor.compose(images, out), jpegs)),
    ]


def _after(panoramas) -> list[Stage]:
    encoded, packets = _encoding(panoramas)
    decoder = video_decoder()
    jpegs = [_jpeg(panorama, _QUALITY) for panorama in panoramas]
    return [
        Stage('encode as JPEG', _cpu_ms(lambda p: _jpeg(p, _QUALITY), panoramas), _mbit_s(jpegs)),
        Stage('convert to 4:2:0', _cpu_ms(lambda p: to_planes(p, 'bgr8'), panoramas)),
        Stage('convert and encode as H.264', encoded, _mbit_s(packets)),
        Stage('at the base: decode the JPEG', _cpu_ms(decoded, jpegs)),
        Stage('at the base: decode the H.264', _cpu_ms(decoder.decode, packets)),
    ]


def _encoding(pictures) -> tuple[Spread, list[bytes]]:
    """Return what encoding pictures as H.264 takes, and the packets."""
    settings = VideoSettings(video_encoder='libx264')
    encoder, packets, times_s = video_encoder(settings), [], iter(np.arange(COUNT) / RATE_HZ)

    def encode(image):
        packets.append(encoder.encode(image, 'bgr8', next(times_s)).data)

    return _cpu_ms(encode, pictures), packets


def _twice(spread: Spread) -> Spread:
    return Spread(2 * spread.median, 2 * spread.low, 2 * spread.high)


def _jpeg(image: np.ndarray, quality: int) -> np.ndarray:
    return cv2.imencode('.jpg', image, (cv2.IMWRITE_JPEG_QUALITY, quality))[1]


def _cpu_ms(function: Callable, arguments: Sequence) -> Spread:
    times_ms = []
    for argument in islice(cycle(arguments), COUNT):
        begin_s = time.process_time()
        function(argument)
        times_ms.append((time.process_time() - begin_s) * 1e3)
    return spread(times_ms)


def _mbit_s(pictures: Sequence) -> float:
    return 8e-6 * RATE_HZ * sum(map(len, pictures)) / len(pictures)
