"""A node whose stages are timed: `timed_node.py panorama|viewer FILE`, then ROS's own arguments.

The synthetic cameras of the panorama node are others here: they turn, are noisy, and the time is
painted into their pictures. FILE gets a line `STAGE MS` for each picture and stage.
"""

import sys
import time
from functools import wraps

import cv2
import numpy as np

from fisheye_bridge.topics import ImagePublisher
from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.scene import Scene
from fisheye_capture.sources import SOURCES, SourceKind
from fisheye_capture.synthetic import SyntheticSource
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.surface import Surface
from fisheye_testing.painted_time import paint
from panorama_stitch.nodes import panorama_node
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline
from panorama_viewer import viewer_node
from panorama_viewer.feeds import VideoFeed
from panorama_viewer.status import ViewerStatus

_WORLD_PX = 2400
_TURN_DEG_S = 20.0
_NOISE = 3.0
"""Standard deviation, grey levels."""
_TILES = 8


class TurningSource(SyntheticSource):
    """A synthetic camera on a robot that turns, with a sensor's noise and the painted time."""

    def __init__(self, settings: CaptureSettings):
        super().__init__(settings)
        lens, angles_deg = self.camera.lens, (settings.synthetic_yaw_deg, 0.0, 0.0)
        focal_px = _WORLD_PX / (2 * np.pi)
        size = _WORLD_PX, _WORLD_PX // 2
        world = Surface('equirectangular', *size, focal_px, size[0] / 2 - 0.5, size[1] / 2 - 0.5)
        self._world = Scene().view(world).frame(0)
        y, x = np.mgrid[: lens.height, : lens.width].astype(float)
        rays = lens.unproject(np.stack([x, y], axis=-1).reshape(-1, 2))[0]
        rays = np.nan_to_num(rays) @ Attitude(*np.radians(angles_deg)).matrix.T
        pixels = world.project(rays)[0].reshape(lens.height, lens.width, 2)
        self._x, self._y = np.moveaxis(np.nan_to_num(pixels).astype(np.float32), -1, 0)
        random = np.random.default_rng(1)
        noise = np.abs(random.normal(0, _NOISE, (_TILES, lens.height, lens.width, 3)))
        self._noise = noise.astype(np.uint8)

    def _picture(self, stamp_ns):
        turned_px = stamp_ns / 1e9 % 360 * _TURN_DEG_S / 360 * _WORLD_PX % _WORLD_PX
        image = cv2.remap(
            self._world,
            self._x + np.float32(turned_px),
            self._y,
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_WRAP,
        )
        image = cv2.add(image, self._noise[stamp_ns // 1000 % _TILES])
        paint(image, stamp_ns)
        return image


def main() -> int:
    """Run the node."""
    kind, path = sys.argv[1:3]
    del sys.argv[1:3]
    with open(path, 'w', buffering=1) as out:  # noqa: PTH123

        def note(stage: str, ms: float) -> None:
            out.write(f'{stage} {ms:.2f}\n')

        return {'panorama': panorama, 'viewer': viewer}[kind](note)


def panorama(note) -> int:
    """Run the panorama node: capture, pair, compose, publish."""
    SOURCES['synthetic'] = SourceKind(lambda name: name == 'synthetic', TurningSource)

    def age(ns):
        return (time.time_ns() - ns) / 1e6

    take, following, draw, publish = (
        StitchPipeline.take,
        StitchPipeline.next,
        Panorama.draw,
        ImagePublisher.publish,
    )

    @wraps(take)
    def timed_take(self, camera, stamp_ns, *rest):
        note('capture', age(stamp_ns))
        return take(self, camera, stamp_ns, *rest)

    @wraps(following)
    def timed_next(self):
        panorama = following(self)
        if panorama is not None:
            note('paired', age(panorama.stamp_ns))
        return panorama

    StitchPipeline.take, StitchPipeline.next = timed_take, timed_next
    Panorama.draw = timed(draw, 'compose', note)
    ImagePublisher.publish = timed(publish, 'publish', note)
    return panorama_node.main()


def viewer(note) -> int:
    """Run the viewer node: arrival, encode."""
    arrived, coded = ViewerStatus.picture, VideoFeed.coded

    @wraps(arrived)
    def timed_arrived(self, now_s, delay_s):
        note('arrived', delay_s * 1e3)
        return arrived(self, now_s, delay_s)

    @wraps(coded)
    async def timed_coded(self, picture):
        begin = time.perf_counter()
        data = await coded(self, picture)
        note('encode', (time.perf_counter() - begin) * 1e3)
        return data

    ViewerStatus.picture, VideoFeed.coded = timed_arrived, timed_coded
    return viewer_node.main()


def timed(function, stage, note):
    """Return a function that notes how long each call takes."""

    @wraps(function)
    def run(*arguments):
        begin = time.perf_counter()
        result = function(*arguments)
        note(stage, (time.perf_counter() - begin) * 1e3)
        return result

    return run


if __name__ == '__main__':
    sys.exit(main())
