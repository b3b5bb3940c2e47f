"""The panorama as video: what it takes of a link, how good it is, and how late.

Real panoramas that turn, with the noise of a sensor, are encoded and decoded; then a running rig
is watched by subscribers that come and go.
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from compose import compositor_of
from pairs import ImagePair, real_pairs
from sensor_msgs.msg import CompressedImage
from targets import Requirement
from turning import turning

from fisheye_bridge.qos import VIDEO_INPUT
from fisheye_bridge.stamps import ns_of
from fisheye_core.errors import FisheyeError
from fisheye_core.h264_encoder import H264Encoder
from fisheye_core.video import video_decoder
from fisheye_core.video_settings import VideoSettings
from fisheye_testing.domains import unused_domain
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

RATE_HZ, PANORAMA_DEG = 30.0, 310.0
SIZE = (480, 640)
SETTLED = 30
"""Pictures until the first keyframe has been improved upon."""
START_S = 60.0
JPEG_QUALITY = 80
CAP_MBIT_S = VideoSettings.video_bitrate_kbps / 1000
MOST_MBIT_S, LEAST_DB, LATE_S, ENCODING_MS = 1.05 * CAP_MBIT_S, 35.0, 0.3, 15.0


def main() -> int:
    """Print the tables; 1 if a limit is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, default=5.0, help='of video of each rig')
    parser.add_argument('--joins', type=int, default=20, help='subscribers that come late')
    options = parser.parse_args()
    pairs = [pair for pair in real_pairs() if pair.images[0].shape[:2] == SIZE]
    if not pairs:
        sys.exit('No rigs are there; set FISHEYE_DATA to the folder that holds rigs/.')
    targets = []
    print(
        'rig        keyframes   Mbit/s  most in 1 s  largest kB   PSNR  least dB  late  '
        'ms p50   p99   JPEG Mbit/s  PSNR'
    )
    for pair in pairs:
        pictures = pictures_of(pair, round(options.seconds * RATE_HZ))
        for keyframe_s in (VideoSettings.video_keyframe_s, 0.0):
            targets += quality(pair.name, pictures, keyframe_s)
    targets += live(options.joins)
    print('', *targets, sep='\n')
    return int(any(target.excess > 1 for target in targets))


def pictures_of(pair: ImagePair, count: int) -> list[np.ndarray]:
    """Return the panorama of a pair as it turns."""
    compositor = compositor_of(pair, 'feather', 'linear', gain=True)
    surface = compositor.layout.surface
    panorama = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(pair.images, panorama)
    return list(turning(panorama, PANORAMA_DEG, RATE_HZ, count))


def quality(name: str, pictures: Sequence[np.ndarray], keyframe_s: float) -> list[Requirement]:
    """Encode and decode, print a row, return what was to be reached."""
    encoder = H264Encoder(
        bitrate_kbps=VideoSettings.video_bitrate_kbps, keyframe_s=keyframe_s, encoder='libx264'
    )
    mbits, psnr_db, wall_ms, late = round_trip(encoder, pictures)
    window = round(RATE_HZ)
    most = max(sum(mbits[at : at + window]) for at in range(len(mbits) - window + 1))
    settled = psnr_db[SETTLED:]
    jpeg_mbit_s, jpeg_db = as_jpeg(pictures)
    print(
        f'{name:10s} {f"each {keyframe_s:g} s" if keyframe_s else "rolling":9s} '
        f'{np.mean(mbits) * RATE_HZ:8.2f} {most:12.2f} {125 * max(mbits):11.1f} '
        f'{np.mean(settled):6.1f} {min(settled):9.1f} {late:5d} {np.median(wall_ms):7.2f} '
        f'{np.percentile(wall_ms, 99):5.1f} {jpeg_mbit_s:13.1f} {jpeg_db:5.1f}',
        flush=True,
    )
    what = f'{name}, keyframes {f"each {keyframe_s:g} s" if keyframe_s else "on request"}'
    return [
        Requirement(f'{what}, Mbit/s in any second', most, MOST_MBIT_S),
        Requirement(f'{what}, least PSNR dB', min(settled), LEAST_DB, is_least=True),
        Requirement(f'{what}, pictures late', late, 0),
        Requirement(f'{what}, p99 of encoding ms', float(np.percentile(wall_ms, 99)), ENCODING_MS),
    ]


def round_trip(encoder: H264Encoder, pictures: Sequence[np.ndarray]):
    """Return Mbit, PSNR and encoding ms of each picture, and how many came out late."""
    decoder, mbits, psnr_db, wall_ms, late = video_decoder(), [], [], [], 0
    former = np.zeros(pictures[0].shape[:2], np.uint8)
    for number, picture in enumerate(pictures):
        begin_s = time.perf_counter()
        packet = encoder.encode(picture, 'bgr8', number / RATE_HZ)
        wall_ms.append(1e3 * (time.perf_counter() - begin_s))
        mbits.append(8e-6 * len(packet.data))
        grey, (height, width) = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), picture.shape[:2]
        shown = decoder.decode(packet.data, 'mono8', number / RATE_HZ)[:height, :width]
        psnr_db.append(cv2.PSNR(shown, grey))
        late += cv2.PSNR(shown, former) > psnr_db[-1]
        former = grey
    return mbits, psnr_db, wall_ms, late


def as_jpeg(pictures: Sequence[np.ndarray]) -> tuple[float, float]:
    """Return Mbit/s and PSNR of luminance of the same pictures as JPEG."""
    quality = cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY
    jpegs = [cv2.imencode('.jpg', picture, quality)[1] for picture in pictures]
    grey = cv2.cvtColor(pictures[-1], cv2.COLOR_BGR2GRAY)
    psnr_db = cv2.PSNR(cv2.imdecode(jpegs[-1], cv2.IMREAD_GRAYSCALE), grey)
    return 8e-6 * RATE_HZ * sum(map(len, jpegs)) / len(jpegs), psnr_db


def live(joins: int) -> list[Requirement]:
    """Watch the panorama node on synthetic cameras, and how soon late subscribers see it."""
    domain = unused_domain()
    with (
        tempfile.TemporaryDirectory() as folder,
        Watcher(domain) as watcher,
        RigProcesses(domain, Path(folder)) as rig,
    ):
        rig.start('panorama', width=640, height=480, frame_rate_hz=RATE_HZ)
        wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'an overlap')
        waits_s = [first_s(watcher) for _ in range(joins)]
        watcher.restart()
        ages_ms = ages(watcher)
        image_ms = dict(zip(watcher.stamps_ns, watcher.latencies_ms, strict=True))
    later_ms = [ages_ms[ns] - image_ms[ns] for ns in ages_ms.keys() & image_ms.keys()]
    for what, values in (
        ('panorama/image at a subscriber, ms old', [*image_ms.values()]),
        ('panorama/video there, decoded, ms old', [*ages_ms.values()]),
        ('video after the image of its stamp, ms', later_ms),
    ):
        print('{}: {:.1f} (p99 {:.1f})'.format(what, *np.percentile(values, (50, 99))))
    print(f'first picture of a late subscriber: {sorted(round(w, 3) for w in waits_s)} s')
    return [
        Requirement(
            'first picture of a late subscriber, median s', float(np.median(waits_s)), LATE_S
        ),
        Requirement('video after the image, median ms', float(np.median(later_ms)), ENCODING_MS),
    ]


def first_s(watcher: Watcher) -> float:
    """Subscribe anew; return when the first picture is decoded."""
    decoder, began_s, shown_s = video_decoder(), time.monotonic(), []

    def take(message):
        if not shown_s and decoder.decode(bytes(message.data)) is not None:
            shown_s.append(time.monotonic())

    subscription = watcher.node.create_subscription(
        CompressedImage, 'panorama/video/compressed', take, VIDEO_INPUT
    )
    wait_for(lambda: shown_s, START_S, 'a picture')
    watcher.node.destroy_subscription(subscription)
    return shown_s[0] - began_s


def ages(watcher: Watcher, count: int = 200) -> dict[int, float]:
    """Return how old pictures are when they were decoded, ms, by their stamps."""
    decoder, ages_ms = video_decoder(), {}

    def take(message):
        stamp_ns = ns_of(message.header.stamp)
        if decoder.decode(bytes(message.data)) is not None:
            ages_ms[stamp_ns] = (time.time_ns() - stamp_ns) / 1e6

    subscription = watcher.node.create_subscription(
        CompressedImage, 'panorama/video/compressed', take, VIDEO_INPUT
    )
    wait_for(lambda: len(ages_ms) >= count, START_S, 'video')
    watcher.node.destroy_subscription(subscription)
    return ages_ms


if __name__ == '__main__':
    try:
        sys.exit(main())
    except (FisheyeError, RuntimeError, TimeoutError) as error:
        sys.exit(f'The benchmark failed: {error}')
