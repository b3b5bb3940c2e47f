"""A pipeline of two cameras, fed with what they see until something holds."""

import threading
import time
from dataclasses import replace

import numpy as np

from fisheye_capture.synthetic import synthetic_lens
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline

LENS = synthetic_lens(320, 240, np.radians(170))
YAW = np.radians(140)
SETTINGS = PanoramaSettings(stale_after_s=10.0)
"""A pause of a busy machine makes no camera stale."""
HASTY = replace(SETTINGS, stale_after_s=0.2)
DEADLINE_S = 20.0
STEP_NS = 33_000_000


class Line:
    """A pipeline, what it made, and a hand that feeds it."""

    def __init__(self, settings=SETTINGS):
        self.published, self.warnings, self.economical = [], [], []
        self.news, self.may_draw = threading.Event(), threading.Event()
        self.may_draw.set()
        self.pipeline = StitchPipeline(settings)
        for camera in settings.cameras:
            self.pipeline.place(camera, LENS, settings.surface_of(LENS))
        self.stamp_ns = 0
        self._thread = threading.Thread(target=self._draw, daemon=True)
        self._thread.start()

    def stop(self):
        self.pipeline.stop()
        self._thread.join()

    def _draw(self):
        while (panorama := self.pipeline.next()) is not None:
            assert self.may_draw.wait(DEADLINE_S)
            surface, image = panorama.surface, panorama.images[0]
            out = np.empty((surface.height, surface.width, *image.shape[2:]), np.uint8)
            panorama.draw(out)
            self.published.append((panorama.stamp_ns, out, panorama.stale))
            self.economical.append(panorama.is_economical)

    def feed(self, pictures, until, what):
        """Feed frames of these cameras until a condition holds."""
        deadline = time.monotonic() + DEADLINE_S
        while not until():
            assert time.monotonic() < deadline, what
            self.stamp_ns += STEP_NS
            for camera, picture in pictures.items():
                self.take(camera, picture)
            self.warnings += self.pipeline.take_notices()
            self.news.wait(0.01)

    def take(self, camera, picture, later_ns=0):
        encoding = 'mono8' if picture.ndim == 2 else 'bgr8'
        self.pipeline.take(camera, self.stamp_ns + later_ns, picture, encoding)


def overlap_in_use(line):
    return line.pipeline.rig.overlaps[0]
