"""Overlaps measured and compositors built in the background, while the former stay in use."""

from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import replace
from time import monotonic

import numpy as np

from fisheye_core.background import Background
from fisheye_core.errors import FisheyeError, OverlapError
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.overlap.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.pipeline.frame_sets import FrameSets
from panorama_stitch.pipeline.overlap_choice import believed, kept
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings
from panorama_stitch.pipeline.recent_frames import RecentFrames, Remembered
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState
from panorama_stitch.pipeline.seam_watch import SeamWatch

_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 60.0
"""Between two tries to find an overlap."""
_OLDEST_S = 5.0
"""Frames that came longer ago, and than it takes to call a camera stale, tell nothing of now."""
_NOTICES = 20


class CompositorBuilder:
    """Keeps the compositor up to date with the cameras, the settings and the overlaps.

    Attributes
    ----------
    compositor : Compositor or None
        In use now.
    trouble : str
        Why there is no newer compositor; '' if nothing is wrong.
    """

    def __init__(self, rig: RigState, watch: SeamWatch, frames: FrameSets):
        """Start idle.

        Parameters
        ----------
        rig, watch, frames
            What is known of the cameras, what was seen over time, and what tells who is silent.
        """
        self.compositor: Compositor | None = None
        self.trouble = ''
        self._rig, self._watch, self._frames = rig, watch, frames
        self._background = Background(self._failed)
        self._recent = RecentFrames()
        self._notices: deque[str] = deque(maxlen=_NOTICES)
        self._due_s = 0.0
        self._pause_s = _FIRST_PAUSE_S
        self._job: Future | None = None
        self._inherited: RigState | None = None

    def take(
        self,
        images: Sequence[np.ndarray],
        stamp_ns: int,
        settings: PanoramaOutputSettings,
        *,
        is_live: bool,
    ) -> None:
        """Account for a frame set, and start what is due unless something is in work.

        Parameters
        ----------
        images, stamp_ns
            One image of each camera, and when the oldest was taken.
        settings
            To be used from now on.
        is_live
            Whether no image is stale: only such are measured.
        """
        frames = Remembered(images, stamp_ns)
        if is_live and self._recent.take(frames):
            self._due_s = 0.0
        busy = self._job is not None and not self._job.done()
        if not busy and self._rig.is_complete and monotonic() >= self._due_s:
            self._due_s = float('inf')
            self._job = self._background.do(self._prepare, frames, settings, is_live)

    def renew(self, *, forget: bool) -> None:
        """Request a new compositor; `forget` what the cameras showed so far."""
        if forget:
            self._recent.forget()
            self._pause_s = _FIRST_PAUSE_S
        self._due_s = 0.0

    def calibrate(self, settings: PanoramaOutputSettings, method: str, save: bool) -> Future:
        """Measure the overlaps anew on the frame sets that are remembered.

        Parameters
        ----------
        settings
            How to measure and compose.
        method
            One of `METHODS`; '' for that of the settings.
        save
            Also write the result to the overlap file, if all were found.

        Returns
        -------
        Future
            Of a list of `Overlap`. Where no overlap is found, or none that can be believed, one
            that was found before stays in use. With a `FisheyeError` nothing has changed: an
            `OverlapError` where what is remembered is too old, say.
        """
        return self._background.do(self._calibrate, settings, method, save)

    def inherit(self, former: RigState) -> None:
        """Prefer overlaps that are known already to those of the overlap file."""
        if former.overlaps and all(overlap.found for overlap in former.overlaps):
            self._inherited = former

    def tell(self, sentence: str) -> None:
        """Note what did not work, for `take_notices`."""
        self._notices.append(sentence)

    def take_notices(self) -> list[str]:
        """Return the sentences about what did not work since the last call."""
        notices = list(dict.fromkeys(self._notices))
        self._notices.clear()
        return notices

    def stop(self) -> None:
        """End the thread."""
        self._background.stop()

    def _failed(self, error: FisheyeError) -> None:
        self.trouble = str(error)
        self.tell(self.trouble)
        self._wait(_FIRST_PAUSE_S)

    def _wait(self, pause_s: float) -> None:
        """Try again after a pause, or sooner where something was changed meanwhile."""
        self._due_s = min(self._due_s, monotonic() + pause_s)

    def _prepare(
        self, newest: Remembered, settings: PanoramaOutputSettings, is_live: bool
    ) -> None:
        """Find overlaps if there are none, and build the compositor that uses them."""
        rig = self._rig
        if rig.overlaps is None:
            self._read(settings.overlap_file)
        found = rig.overlaps and all(overlap.found for overlap in rig.overlaps)
        remembered = self._recent.all()
        if not found and settings.auto_calibrate and remembered:
            surfaces = rig.surfaces
            measured = self._measured(remembered, settings, settings.method)
            overlaps = kept(measured, rig.overlaps or [], len(rig.cameras), prefers_former=True)
            if not rig.set_overlaps(overlaps, surfaces):
                self._due_s = 0.0
                return
            if all(overlap.found for overlap in overlaps):
                self._pause_s = _FIRST_PAUSE_S
            else:
                self._wait(self._pause_s)
                self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
        elif not found and settings.auto_calibrate and is_live:
            # What was remembered was forgotten a moment ago; the next frame set can be measured.
            self._due_s = 0.0
            return
        self._use(newest, settings)

    def _calibrate(
        self, settings: PanoramaOutputSettings, method: str, save: bool
    ) -> list[Overlap]:
        rig = self._rig
        if not rig.is_complete:
            raise OverlapError('it is not known yet what every camera sees; are all running?')
        if save and not settings.overlap_file:
            raise OverlapError('overlap_file is empty; expected the file to save the overlap in')
        remembered, surfaces = self._recent.all(), rig.surfaces
        if remembered:
            self._check_age(max(_OLDEST_S, settings.stale_after_s))
        measured = self._measured(remembered, settings, method or settings.method)
        if settings.method != 'paper':
            measured = [
                believed(new, surfaces[index % len(surfaces)], settings.min_confidence)
                for index, new in enumerate(measured)
            ]
        overlaps = kept(measured, rig.overlaps or [], len(rig.cameras))
        if save and all(overlap.found for overlap in measured):
            write_overlaps(
                settings.overlap_file, rig.cameras, surfaces, overlaps, rig.lens_focals_px
            )
        if not rig.set_overlaps(overlaps, surfaces):
            raise OverlapError('the cameras changed meanwhile; expected them to stay as they are')
        self._use(remembered[-1], settings)
        return measured

    def _check_age(self, limit_s: float) -> None:
        """Raise an `OverlapError` where what is remembered is older."""
        age_s = self._recent.age_s
        if age_s <= limit_s:
            return
        silent = ', '.join(
            f'{camera} has given no frame for {silent_s:.0f} s'
            for camera, silent_s in self._frames.ages_s().items()
        )
        raise OverlapError(
            (silent or f'no frames have belonged together for {age_s:.0f} s')
            + f'; expected frames of all cameras from the last {limit_s:g} s'
        )

    def _measured(
        self, remembered: list[Remembered], settings: PanoramaOutputSettings, method: str
    ) -> list[Overlap]:
        images = [frames.images for frames in remembered]
        overlaps = self._watch.sharpened(measure_overlaps(self._rig, images, settings, method))
        return [replace(overlap, stamp_ns=remembered[-1].stamp_ns) for overlap in overlaps]

    def _use(self, newest: Remembered, settings: PanoramaOutputSettings) -> None:
        self.compositor = self._rig.compositor(settings, newest.images)
        self.trouble = ''

    def _read(self, path: str) -> None:
        rig = self._rig
        surfaces = rig.surfaces
        if self._inherited and rig.inherit(self._inherited):
            return
        try:
            if overlaps := read_overlaps(path, rig.cameras, surfaces, rig.lens_focals_px):
                rig.set_overlaps(overlaps, surfaces)
        except FisheyeError as error:
            self.tell(f'{error}; the overlap is measured instead')
