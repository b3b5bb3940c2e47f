"""The stitch pipeline: frames -> pair -> compose -> publish, whatever the cameras do.

`StitchPipeline.take` pairs each frame as it comes; `StitchPipeline.next` waits for the frames of
all cameras that belong together; `Panorama.draw` composes them into the memory that gets
published. Nothing here calls back: whoever owns the pipeline asks it.
"""

from collections.abc import Sequence
from concurrent.futures import Future

import numpy as np

from fisheye_core.encodings import alike
from fisheye_core.errors import FisheyeError
from fisheye_geometry.inertial import ImuReading
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.pipeline.calibration_request import CalibrationRequest
from panorama_stitch.pipeline.compositor_builder import CompositorBuilder
from panorama_stitch.pipeline.economy import Economy
from panorama_stitch.pipeline.frame_sets import FrameSet, FrameSets
from panorama_stitch.pipeline.live_level import LiveLevel
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.panorama_settings import MountSettings, PanoramaOutputSettings
from panorama_stitch.pipeline.rig_state import RigState
from panorama_stitch.pipeline.seam_watch import SeamWatch


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
    frames : FrameSets
        The frames that come, and which of them belong together.
    broken : int
        Frame sets that could not be composed.
    economy : Economy
        Whether there is time for all that blends can do.
    level : LiveLevel
        What an IMU says.
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
        self.frames = FrameSets(settings, self.rig)
        self.broken = 0
        self.economy = Economy()
        self.watch = SeamWatch(self.rig)
        self._builder = CompositorBuilder(self.rig, self.watch, self.frames)
        self.level = LiveLevel(self.rig)
        self._calibration = CalibrationRequest(self._builder.calibrate)
        self._dimensions = 0

    def take(self, camera: str, stamp_ns: int, image: np.ndarray, encoding: str) -> None:
        """Add a frame of a camera; nobody may write to it afterwards.

        The first one in colour decides the order of the panorama's channels.

        Raises
        ------
        ImageFormatError
            If it is not of the size that the camera is known to give.
        """
        if self.frames.take(camera, stamp_ns, image, encoding):
            self.economy.arrived()

    def next(self) -> Panorama | None:
        """Wait for frames that can be composed; return None when stopped."""
        self.economy.ended()
        while (frames := self.frames.get()) is not None:
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
        with self.frames.lock:
            if self.rig.place(camera, source, surface, interpolation):
                self.frames.forget(camera, source.height, source.width)
                self._builder.renew(forget=True)

    def apply(self, settings: PanoramaOutputSettings) -> None:
        """Use other settings from the next frames on."""
        self.settings = settings
        self.frames.apply(settings)
        self._builder.renew(forget=False)

    def feel(self, reading: ImuReading) -> None:
        """Level by what an IMU says, where `level` is imu."""
        if self.level.feel(reading) and self.settings.level == 'imu':
            self._builder.renew(forget=False)

    def inherit(self, former: 'StitchPipeline') -> None:
        """Use the overlaps of another pipeline where the cameras show what they showed there."""
        self._builder.inherit(former.rig)

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew, off the frame path; as of `CompositorBuilder.calibrate`."""
        return self._calibration.ask(self.settings, method, save)

    def leave_room(self, took_s: float) -> None:
        """Hold the next panorama up where a calibration needs it, `CalibrationRequest`."""
        self._calibration.leave_room(took_s)

    def stop(self) -> None:
        """End `next` and the background work."""
        self.frames.close()
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
        return [*apart, *solution.faults]

    @property
    def trouble(self) -> str:
        """Why no newer panorama can be laid out; '' if nothing is wrong."""
        if self.compositor is None and (missing := self.frames.missing):
            return f'waiting for pictures of {", ".join(missing)}'
        return self._builder.trouble

    def take_notices(self) -> list[str]:
        """Return the sentences about what did not work since the last call."""
        return self._builder.take_notices()

    def _panorama(self, frames: FrameSet) -> Panorama | None:
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
        if frames.ages_s:
            images = self.frames.dimmed(frames)
        elif self.watch.is_due:
            self.watch.take(images, self.overlaps)
        stale = {
            camera: (compositor.layout.shown_columns(cameras.index(camera)), age_s)
            for camera, age_s in frames.ages_s.items()
        }
        return Panorama(
            compositor,
            images,
            frames.stamp_ns,
            self.frames.encoding(images[0]),
            stale,
            frozenset(map(cameras.index, frames.ages_s)),
            self.economy.started(),
            self.level.orientation(compositor, frames.stamp_ns, self.settings),
        )
