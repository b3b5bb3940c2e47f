"""The stitch pipeline: frames -> pair -> compose -> publish, whatever the cameras do.

`StitchPipeline.take` pairs each frame as it comes; `StitchPipeline.next` waits for the frames of
all cameras that belong together; `Panorama.draw` composes them into the memory that gets
published. Nothing here calls back: whoever owns the pipeline asks it.
"""

from collections.abc import Sequence
from concurrent.futures import Future, wait
from threading import Lock
from time import monotonic, monotonic_ns
from typing import NamedTuple

import numpy as np

from fisheye_core.encodings import alike, converted
from fisheye_core.errors import FisheyeError
from fisheye_core.latest_only import LatestOnlyQueue
from fisheye_core.rate_meter import RateMeter
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.pipeline.compositor_builder import CompositorBuilder
from panorama_stitch.pipeline.economy import Economy
from panorama_stitch.pipeline.pairing import FramePairing
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.panorama_settings import MountSettings, PanoramaOutputSettings
from panorama_stitch.pipeline.rig_state import RigState
from panorama_stitch.pipeline.seam_watch import SeamWatch
from panorama_stitch.pipeline.stale import StaleCameras

_GRAVITY_RAD = np.radians(0.5)
"""A panorama is levelled anew when gravity has turned by more."""
_WAITING = 2
"""Frame sets that may wait to be composed: a moment without the processor loses none."""
_ROOM = 2.0
"""What a measurement that was asked for gets, in units of what a panorama takes."""


class _Frame(NamedTuple):
    """An image that waits for its partner, and when it was taken."""

    image: np.ndarray
    stamp_ns: int


class _FrameSet(NamedTuple):
    """An image of each camera; those with an age are not live."""

    images: Sequence[np.ndarray]
    stamp_ns: int
    ages_s: dict[str, float]


class StitchPipeline:
    """Makes panoramas of frames as they come, from any thread.

    The newest frame set is composed; an older one that still waits then is dropped. Where a
    camera is silent, the others go on beside its last image, dimmed.

    Attributes
    ----------
    settings : PanoramaOutputSettings
        In use; `apply` changes them.
    rig : RigState
        What is known of the cameras.
    watch : SeamWatch
        How well the overlaps in use hold.
    pairing : FramePairing
        What waits for its partner.
    rates : dict of RateMeter
        At which each camera's frames come.
    broken : int
        Frame sets that could not be composed.
    economy : Economy
        Whether there is time for all that blends can do.
    """

    def __init__(self, settings: PanoramaOutputSettings, mounts: Sequence[MountSettings] = ()):
        """Start.

        Parameters
        ----------
        settings
            Also say which cameras there are.
        mounts
            What is known of each camera; () for nothing.
        """
        self.settings = settings
        self.rig = RigState(
            settings.cameras,
            [mount.mount for mount in mounts],
            [mount.mask_file for mount in mounts],
        )
        self.pairing = FramePairing(settings.cameras, round(settings.max_pair_skew_s * 1e9))
        self.rates = {camera: RateMeter() for camera in settings.cameras}
        self.broken = 0
        self.economy = Economy()
        self.watch = SeamWatch(self.rig)
        self._builder = CompositorBuilder(self.rig, self.watch)
        self._stale = StaleCameras(settings.cameras)
        self._waiting: LatestOnlyQueue[_FrameSet] = LatestOnlyQueue(_WAITING)
        self._lock = Lock()
        self._paired_s = monotonic()
        self._asked: Future | None = None
        self._color = ''
        self._dimensions = 0

    def take(self, camera: str, stamp_ns: int, image: np.ndarray, encoding: str) -> None:
        """Add a frame of a camera; nobody may write to it afterwards.

        The first one in colour decides the order of the panorama's channels.

        Raises
        ------
        ImageFormatError
            If it is not of the size that the camera is known to give.
        """
        self.rig.check(camera, image)
        self.rates[camera].count()
        with self._lock:
            if encoding != 'mono8':
                self._color = self._color or encoding
                image = converted(image, encoding, self._color)
            self._stale.note(camera, image)
            paired = self._paired(camera, _Frame(image, stamp_ns))
            if paired := paired or self._beside_stale(camera, stamp_ns):
                self._paired_s = monotonic()
                self._waiting.put(paired)
                self.economy.arrived()

    def next(self) -> Panorama | None:
        """Wait for frames that can be composed; return None when stopped."""
        self.economy.ended()
        while (frames := self._waiting.get()) is not None:
            try:
                if panorama := self._panorama(frames):
                    return panorama
            except FisheyeError as error:
                self.broken += 1
                self._builder.tell(f'a pair of frames was dropped: {error}')
        return None

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> None:
        """Set what a camera's images show; parameters and errors as of `RigState.place`."""
        with self._lock:
            if self.rig.place(camera, source, surface, interpolation):
                last = self._stale.last(camera)
                if last is not None and last.shape[:2] != (source.height, source.width):
                    self.pairing.clear()
                    self._waiting.clear()
                    self._stale.forget(camera)
                self._builder.renew(forget=True)

    def apply(self, settings: PanoramaOutputSettings) -> None:
        """Use other settings from the next frames on."""
        with self._lock:
            if settings.pair_by != self.settings.pair_by:
                self.pairing.clear()
            self.settings = settings
            self.pairing.max_skew_ns = round(settings.max_pair_skew_s * 1e9)
        self._builder.renew(forget=False)

    def set_gravity(self, gravity: np.ndarray) -> None:
        """Level the panorama by where things fall, (3,) in the robot's frame; see `RigState`."""
        former, self.rig.gravity = self.rig.gravity, gravity
        if self.settings.level == 'imu' and (
            former is None or _angle_rad(former, gravity) > _GRAVITY_RAD
        ):
            self._builder.renew(forget=False)

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew, off the frame path; as of `CompositorBuilder.calibrate`."""
        self._asked = self._builder.calibrate(self.settings, method, save)
        return self._asked

    def leave_room(self, took_s: float) -> None:
        """Leave a measurement that was asked for its share of a busy machine.

        Parameters
        ----------
        took_s
            How long the last panorama took; composing would take all there is.
        """
        if self._asked and not self._asked.done():
            wait([self._asked], _ROOM * took_s)

    def stop(self) -> None:
        """End `next` and the background work."""
        self._waiting.close()
        self._builder.stop()
        self.watch.stop()

    @property
    def compositor(self) -> Compositor | None:
        """What composes the panoramas now; None before the first."""
        return self._builder.compositor

    @property
    def overlaps(self) -> list[Overlap]:
        """What is in use between neighbours; [] before the first panorama."""
        return self.rig.effective_overlaps(self.settings) if self.compositor else []

    @property
    def rig_faults(self) -> list[str]:
        """What is wrong with the rig as it is drawn, in sentences."""
        overlaps = self.overlaps
        if not overlaps or (not overlaps[0].attitude and all(one.found for one in overlaps)):
            return []
        solution = self.rig.solution(overlaps, self.settings)
        apart = ['no overlap: frames are side by side'] if solution.rig.apart else []
        return [*apart, *(words for words in solution.messages if 'is closed; it' not in words)]

    @property
    def trouble(self) -> str:
        """Why no newer panorama can be laid out; '' if nothing is wrong."""
        if self.compositor is None and (missing := self._stale.missing):
            return f'waiting for pictures of {", ".join(missing)}'
        return self._builder.trouble

    @property
    def unpaired_s(self) -> float:
        """How long ago the last frames belonged together, s; 0 while a camera is stale."""
        return 0.0 if self.ages_s() else monotonic() - self._paired_s

    @property
    def overtaken(self) -> int:
        """Frame sets that were dropped because a newer one came."""
        return self._waiting.dropped

    def ages_s(self) -> dict[str, float]:
        """Return the cameras that are stale, each with the age of its last frame, s."""
        return self._stale.ages_s(self.settings.stale_after_s)

    def take_notices(self) -> list[str]:
        """Return the sentences about what did not work since the last call."""
        return self._builder.take_notices()

    def _paired(self, camera: str, frame: _Frame) -> _FrameSet | None:
        """Pair a frame; return the frame set that it completes."""
        by_stamp = self.settings.pair_by == 'stamp'
        when_ns = frame.stamp_ns if by_stamp else monotonic_ns()
        paired = self.pairing.add(camera, when_ns, frame)
        if paired is None:
            return None
        images, stamps_ns = zip(*(member.frame for member in paired), strict=True)
        return _FrameSet(images, min(stamps_ns), {})

    def _beside_stale(self, camera: str, stamp_ns: int) -> _FrameSet | None:
        """Show what lives beside the last images of the rest; the first living sets the pace."""
        ages_s = self.ages_s()
        living = [name for name in self.rig.cameras if name not in ages_s]
        if not ages_s or camera != living[0] or not self.rig.is_complete:
            return None
        last = {name: self._stale.last(name) for name in self.rig.cameras}
        live = last[camera]
        if live is None:
            return None
        images = [
            self.rig.black(name, live.shape[2:]) if image is None else image
            for name, image in last.items()
        ]
        return _FrameSet(images, stamp_ns, ages_s)

    def _panorama(self, frames: _FrameSet) -> Panorama | None:
        """Join frames and the compositor in use; None where there is none yet."""
        cameras = self.rig.cameras
        for camera, image in zip(cameras, frames.images, strict=True):
            self.rig.check(camera, image)  # they may have waited while a camera became another one
        images = alike(frames.images)
        if images[0].ndim != self._dimensions:
            self._dimensions = images[0].ndim
            self._builder.renew(forget=True)
        self._builder.take(images, frames.stamp_ns, self.settings, is_live=not frames.ages_s)
        compositor = self.compositor
        if compositor is None or not compositor.fits(images):
            return None
        if not frames.ages_s:
            if self.watch.is_due:
                self.watch.take(images, self.overlaps)
        else:
            images = alike(
                [
                    self._stale.dim(camera, image) if camera in frames.ages_s else image
                    for camera, image in zip(cameras, frames.images, strict=True)
                ]
            )
        stale = {
            camera: (compositor.layout.shown_columns(cameras.index(camera)), age_s)
            for camera, age_s in frames.ages_s.items()
        }
        encoding = 'mono8' if images[0].ndim == 2 else self._color
        is_economical = self.economy.started()
        return Panorama(compositor, images, frames.stamp_ns, encoding, stale, is_economical)


def _angle_rad(first: np.ndarray, second: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(first, second)), first @ second))
