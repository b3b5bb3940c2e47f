"""The live line: frames -> pair -> compose -> publish, whatever the cameras do."""

from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock
from time import monotonic, monotonic_ns
from typing import NamedTuple

import numpy as np

from fisheye_core.latest_only import LatestOnlyWorker
from fisheye_core.rate_meter import RateMeter
from fisheye_core.encodings import alike
from fisheye_core.errors import FisheyeError
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline.stale import dimmed
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.pipeline.pairing import FramePairing
from panorama_stitch.pipeline.compositor_builder import CompositorBuilder
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings
from panorama_stitch.pipeline.rig_state import RigState

_WAITING = 2
"""Groups that may wait to be composed: a moment without the processor loses none."""


class _Frame(NamedTuple):
    """A picture that waits for its partner, and when it was taken."""

    image: np.ndarray
    stamp_ns: int


class _Last(NamedTuple):
    """The last frame of a camera, and when it came."""

    image: np.ndarray | None
    arrived_s: float


class _Group(NamedTuple):
    """A picture of each camera; those with an age are not live."""

    images: list[np.ndarray]
    stamp_ns: int
    ages_s: dict[str, float]


class StitchPipeline:
    """Stitches frames as they come.

    Frames may be given from any thread. The newest group is composed in a thread of its own; an
    older one that still waits then is dropped. Where a camera is silent, the others go on beside
    its last picture, dimmed.

    Attributes
    ----------
    stitcher : RigState
        What is known of the cameras.
    pairing : FramePairing
        What waits for its partner.
    rates : dict of RateMeter
        At which each camera's frames come.
    broken : int
        Groups that could not be drawn.
    """

    def __init__(
        self,
        settings: PanoramaOutputSettings,
        *,
        publish: Callable[[Compositor, list[np.ndarray], int, dict[str, float]], None],
        changed: Callable[[int], None],
        warn: Callable[[str], None],
    ):
        """Start.

        Parameters
        ----------
        settings
            Also say which cameras there are.
        publish
            Called in the composing thread with the compositor, the pictures, the older stamp, and
            the ages of those pictures that are not live, s.
        changed
            Called with the stamp, ns, of the pictures from which a new compositor is in use.
        warn
            Called with a sentence about what did not work.
        """
        self.stitcher = RigState(settings.cameras)
        self.pairing = FramePairing(settings.cameras, round(settings.max_pair_skew_s * 1e9))
        self.rates = {camera: RateMeter() for camera in settings.cameras}
        self._preparation = CompositorBuilder(self.stitcher, settings, changed, warn)
        self.broken = 0
        self._publish, self._warn = publish, warn
        self._lock = Lock()
        self._last = {camera: _Last(None, monotonic()) for camera in settings.cameras}
        self._paired_s = monotonic()
        self._dimensions = 0
        self._dark: dict[str, tuple[np.ndarray, np.ndarray]] = {}
        self._composing = LatestOnlyWorker(self._compose, 'compose', _WAITING)

    @property
    def compositor(self) -> Compositor | None:
        """What composes the panoramas now, None before the first."""
        return self._preparation.compositor

    @property
    def overlaps(self) -> list[Overlap]:
        """What is in use between neighbours, [] before the first panorama."""
        if self.compositor is None:
            return []
        return self.stitcher.effective_overlaps(self._preparation.settings)

    @property
    def trouble(self) -> str:
        """Why no newer panorama can be laid out; '' if there is nothing wrong."""
        missing = [camera for camera, last in self._last.items() if last.image is None]
        if self.compositor is None and missing:
            return f'waiting for pictures of {", ".join(missing)}'
        return self._preparation.trouble

    @property
    def unpaired_s(self) -> float:
        """How long ago the last frames belonged together, s; 0 while a camera is stale."""
        return 0.0 if self.ages_s() else monotonic() - self._paired_s

    @property
    def dropped(self) -> int:
        """Groups that were overtaken by a newer one."""
        return self._composing.dropped

    def ages_s(self) -> dict[str, float]:
        """Give the cameras that are stale, each with the age of its last frame, s."""
        now, limit = monotonic(), self._preparation.settings.stale_after_s
        ages = {camera: now - last.arrived_s for camera, last in self._last.items()}
        return {camera: age for camera, age in ages.items() if age > limit}

    def take(self, camera: str, stamp_ns: int, image: np.ndarray) -> None:
        """Take a frame of a camera; nobody may write to it afterwards.

        Raises
        ------
        ImageFormatError
            If it is not of the size that the camera is known to give.
        """
        self.stitcher.check(camera, image)
        self.rates[camera].count()
        with self._lock:
            self._last[camera] = _Last(image, monotonic())
            by_stamp = self._preparation.settings.pair_by == 'stamp'
            when_ns = stamp_ns if by_stamp else monotonic_ns()
            pair = self.pairing.add(camera, when_ns, _Frame(image, stamp_ns))
            if pair is not None:
                self._paired_s = monotonic()
                frames = [member.frame for member in pair]
                images, stamps_ns = zip(*frames, strict=True)
                self._composing.put(_Group(list(images), min(stamps_ns), {}))
            elif ages_s := self.ages_s():
                self._paired_s = monotonic()
                self._go_on_without(ages_s, camera, stamp_ns)

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> None:
        """Say what a camera's pictures show; parameters and errors as `RigState.place`."""
        with self._lock:
            if self.stitcher.place(camera, source, surface, interpolation):
                last = self._last[camera]
                size = source.height, source.width
                if last.image is not None and last.image.shape[:2] != size:
                    self.pairing.clear()
                    self._last[camera] = _Last(None, last.arrived_s)
                self._preparation.renew(forget=True)

    def apply(self, settings: PanoramaOutputSettings) -> None:
        """Use other settings from the next frames on."""
        with self._lock:
            if settings.pair_by != self._preparation.settings.pair_by:
                self.pairing.clear()
            self._preparation.settings = settings
            self.pairing.max_skew_ns = round(settings.max_pair_skew_s * 1e9)
        self._preparation.renew(forget=False)

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew, off the frame path; as `CompositorBuilder.calibrate`."""
        return self._preparation.calibrate(method, save)

    def stop(self) -> None:
        """End the threads."""
        self._composing.stop()
        self._preparation.stop()

    def _go_on_without(self, ages_s: dict[str, float], camera: str, stamp_ns: int) -> None:
        """Show what lives beside the last pictures of the rest; the first living sets the pace."""
        living = [name for name in self._last if name not in ages_s]
        if camera != living[0] or not self.stitcher.is_complete:
            return
        channels = self._last[camera].image.shape[2:]
        images = [
            self.stitcher.black(name, channels) if last.image is None else last.image
            for name, last in self._last.items()
        ]
        self._composing.put(_Group(images, stamp_ns, ages_s))

    def _compose(self, group: _Group) -> None:
        is_live = not group.ages_s
        try:
            # They may have waited while a camera became another one.
            for camera, image in zip(self.stitcher.cameras, group.images, strict=True):
                self.stitcher.check(camera, image)
            images = alike(group.images)
            if images[0].ndim != self._dimensions:
                self._dimensions = images[0].ndim
                self._preparation.renew(forget=True)
            if is_live:
                self._preparation.remember(images, group.stamp_ns)
            self._preparation.start_pending_job(images, group.stamp_ns, is_live=is_live)
            if self.compositor is None:
                return
            if group.ages_s:
                images = alike(
                    [
                        self._dimmed(camera, image) if camera in group.ages_s else image
                        for camera, image in zip(self.stitcher.cameras, group.images, strict=True)
                    ]
                )
            self._publish(self.compositor, images, group.stamp_ns, group.ages_s)
        except FisheyeError as error:
            self.broken += 1
            self._warn(f'a pair of frames was dropped: {error}')

    def _dimmed(self, camera: str, image: np.ndarray) -> np.ndarray:
        """Dim a stale picture, once for all the time that it stays."""
        last, dark = self._dark.get(camera, (None, None))
        if last is not image:
            dark = dimmed(image)
            self._dark[camera] = image, dark
        return dark
