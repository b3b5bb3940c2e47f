"""The live line: frames -> pair -> compose -> publish, with measuring and preparing beside it."""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from threading import Lock
from time import monotonic

import numpy as np

from fisheye_capture.newest import Newest
from fisheye_geometry.background import Background
from fisheye_geometry.errors import FisheyeError, OverlapError
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compositor import Compositor
from panorama_stitch.overlap import Overlap
from panorama_stitch.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.pairing import FramePairing, Stamped
from panorama_stitch.settings import PanoramaOutputSettings
from panorama_stitch.stitcher import Stitcher

_REMEMBERED = 5
"""Pairs that an overlap is measured on."""
_BETWEEN_REMEMBERED_S = 0.2
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 60.0
"""Between two tries to find an overlap."""


class LiveStitcher:
    """Stitches frames as they come.

    Frames may be given from any thread. The newest group is composed in a thread of its own, an
    older one that still waits then is dropped; overlaps are measured and compositors prepared in
    another thread, while frames go on with the former compositor.

    Attributes
    ----------
    stitcher : Stitcher
        What is known of the cameras.
    pairing : FramePairing
        What waits for its partner.
    compositor : Compositor or None
        In use now.
    """

    def __init__(
        self,
        settings: PanoramaOutputSettings,
        *,
        publish: Callable[[Compositor, list[np.ndarray], int], None],
        changed: Callable[[], None],
        warn: Callable[[str], None],
    ):
        """Start.

        Parameters
        ----------
        settings
            Also say which cameras there are.
        publish
            Called in the composing thread with the compositor, the pictures and the older stamp.
        changed
            Called when there is a new compositor.
        warn
            Called with a sentence about what did not work.
        """
        self.stitcher = Stitcher(settings.cameras)
        self.pairing = FramePairing(settings.cameras, round(settings.max_pair_skew_s * 1e9))
        self.compositor: Compositor | None = None
        self._settings = settings
        self._publish, self._changed, self._warn = publish, changed, warn
        self._background = Background(self._failed)
        self._lock = Lock()
        self._recent: deque[list[np.ndarray]] = deque(maxlen=_REMEMBERED)
        self._remembered_at = 0.0
        self._prepare_at = 0.0
        self._pause_s = _FIRST_PAUSE_S
        self._preparing: Future | None = None
        self._composing = Newest(self._compose, 'compose')

    @property
    def dropped(self) -> int:
        """Groups that were overtaken by a newer one."""
        return self._composing.dropped

    def take(self, camera: str, stamp_ns: int, image: np.ndarray) -> None:
        """Take a frame of a camera; nobody may write to it afterwards."""
        with self._lock:
            group = self.pairing.add(camera, stamp_ns, image)
            if group is not None:
                self._composing.put(group)

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> None:
        """Say what a camera's pictures show."""
        with self._lock:
            if self.stitcher.place(camera, source, surface, interpolation):
                self._recent.clear()
                self._prepare_at = 0.0

    def apply(self, settings: PanoramaOutputSettings) -> None:
        """Use other settings from the next frames on.

        Raises
        ------
        OverlapError
            If they do not fit the cameras.
        """
        if self.stitcher.is_complete:
            self.stitcher.in_use(settings)
        self._settings = settings
        self.pairing.max_skew_ns = round(settings.max_pair_skew_s * 1e9)
        self._prepare_at = 0.0

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew, on the recent groups and off the frame path.

        Returns
        -------
        Future
            Of a list of `Overlap`. Where no overlap is found, one that was found before stays in
            use.
        """
        return self._background.do(self._calibrate, method, save)

    def stop(self) -> None:
        """End the threads."""
        self._composing.stop()
        self._background.stop()

    def _compose(self, group: list[Stamped]) -> None:
        images = [member.frame for member in group]
        self._remember(images)
        self._prepare_if_due(images)
        if self.compositor is None:
            return
        try:
            self._publish(self.compositor, images, min(member.stamp_ns for member in group))
        except FisheyeError as error:
            self._warn(f'a pair of frames was dropped: {error}')

    def _remember(self, images: list[np.ndarray]) -> None:
        now = monotonic()
        with self._lock:
            if now - self._remembered_at >= _BETWEEN_REMEMBERED_S or not self._recent:
                self._remembered_at = now
                self._recent.append(images)

    def _prepare_if_due(self, images: Sequence[np.ndarray]) -> None:
        busy = self._preparing is not None and not self._preparing.done()
        if not busy and self.stitcher.is_complete and monotonic() >= self._prepare_at:
            self._prepare_at = float('inf')
            self._preparing = self._background.do(self._prepare, images)

    def _failed(self, error: FisheyeError) -> None:
        self._warn(str(error))
        if self.compositor is None:
            self._prepare_at = monotonic() + _FIRST_PAUSE_S

    def _prepare(self, images: Sequence[np.ndarray]) -> None:
        """Find overlaps if there are none, and build the compositor that uses them."""
        settings = self._settings
        if self.stitcher.overlaps is None and settings.overlap_file:
            self._read(settings.overlap_file)
        found = self.stitcher.overlaps and all(o.found for o in self.stitcher.overlaps)
        if not found and settings.auto_calibrate:
            measured = self._measure(settings.method)
            found = all(overlap.found for overlap in measured)
            if not found:
                self._prepare_at = monotonic() + self._pause_s
                self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
            self.stitcher.overlaps = measured
        self._use(images)

    def _use(self, images: Sequence[np.ndarray]) -> None:
        self.compositor = self.stitcher.compositor(self._settings, images)
        self._changed()

    def _read(self, path: str) -> None:
        if not Path(path).exists():
            return
        try:
            self.stitcher.overlaps = read_overlaps(
                path, self.stitcher.cameras, self.stitcher.surfaces
            )
        except FisheyeError as error:
            self._warn(f'{error}; the overlap is measured instead')

    def _write(self, overlaps: list[Overlap]) -> None:
        if not self._settings.overlap_file:
            raise OverlapError(
                'the overlap was measured but not saved: overlap_file is empty; expected a path'
            )
        write_overlaps(
            self._settings.overlap_file, overlaps, self.stitcher.cameras, self.stitcher.surfaces
        )

    def _measure(self, method: str) -> list[Overlap]:
        with self._lock:
            groups = list(self._recent)
        return self.stitcher.measure(groups, self._settings, method)

    def _calibrate(self, method: str, save: bool) -> list[Overlap]:
        if not self.stitcher.is_complete:
            raise OverlapError('it is not known yet what every camera sees; are all running?')
        measured = self._measure(method or self._settings.method)
        former = self.stitcher.overlaps or measured
        self.stitcher.overlaps = [
            new if new.found or not old.found else old
            for new, old in zip(measured, former, strict=True)
        ]
        self._use(self._recent[-1])
        if save:
            self._write(measured)
        return measured
