"""Preparation: overlaps measured and compositors built, while frames go on with the former."""

from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path
from threading import Lock
from time import monotonic

import numpy as np

from fisheye_geometry.background import Background
from fisheye_geometry.errors import FisheyeError, OverlapError
from panorama_stitch.compositor import Compositor
from panorama_stitch.overlap import Overlap
from panorama_stitch.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.settings import PanoramaOutputSettings
from panorama_stitch.stitcher import Group, Stitcher

_REMEMBERED = 5
"""Pairs that an overlap is measured on."""
_BETWEEN_REMEMBERED_S = 0.2
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 60.0
"""Between two tries to find an overlap."""


class Preparation:
    """Keeps the compositor fit for the cameras, the settings and the overlaps.

    Attributes
    ----------
    compositor : Compositor or None
        In use now.
    settings : PanoramaOutputSettings
        The compositor follows when they are `changed`.
    """

    def __init__(
        self,
        stitcher: Stitcher,
        settings: PanoramaOutputSettings,
        changed: Callable[[], None],
        warn: Callable[[str], None],
    ):
        """Start idle.

        Parameters
        ----------
        stitcher
            What is known of the cameras.
        settings
            To begin with.
        changed
            Called when there is a new compositor.
        warn
            Called with a sentence about what did not work.
        """
        self.compositor: Compositor | None = None
        self.settings = settings
        self._stitcher = stitcher
        self._changed, self._warn = changed, warn
        self._background = Background(self._failed)
        self._lock = Lock()
        self._recent: deque[Group] = deque(maxlen=_REMEMBERED)
        self._remembered_s = 0.0
        self._due_s = 0.0
        self._pause_s = _FIRST_PAUSE_S
        self._job: Future | None = None

    def remember(self, images: Group) -> None:
        """Take a group into account the next time that an overlap is measured."""
        now = monotonic()
        with self._lock:
            is_first = not self._recent
            if is_first:
                self._due_s = 0.0
            if is_first or now - self._remembered_s >= _BETWEEN_REMEMBERED_S:
                self._remembered_s = now
                self._recent.append(images)

    def renew(self, *, forget: bool) -> None:
        """Have a new compositor built soon; `forget` what the cameras showed so far."""
        if forget:
            with self._lock:
                self._recent.clear()
        self._due_s = 0.0

    def go_on(self, images: Group, *, is_live: bool) -> None:
        """Start what is due, unless something is in work; `is_live`: no picture is stale."""
        busy = self._job is not None and not self._job.done()
        if not busy and self._stitcher.is_complete and monotonic() >= self._due_s:
            self._due_s = float('inf')
            self._job = self._background.do(self._prepare, images, is_live)

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew on the groups that are remembered.

        Returns
        -------
        Future
            Of a list of `Overlap`. Where no overlap is found, one that was found before stays in
            use.
        """
        return self._background.do(self._calibrate, method, save)

    def stop(self) -> None:
        """End the thread."""
        self._background.stop()

    def _failed(self, error: FisheyeError) -> None:
        self._warn(str(error))
        if self.compositor is None:
            self._due_s = monotonic() + _FIRST_PAUSE_S

    def _prepare(self, images: Group, is_live: bool) -> None:
        """Find overlaps if there are none, and build the compositor that uses them."""
        stitcher, settings = self._stitcher, self.settings
        if stitcher.overlaps is None and Path(settings.overlap_file).is_file():
            self._read(settings.overlap_file)
        found = stitcher.overlaps and all(overlap.found for overlap in stitcher.overlaps)
        groups = self._groups()
        if not found and settings.auto_calibrate and groups:
            stitcher.overlaps = stitcher.measure(groups, settings, settings.method)
            if not all(overlap.found for overlap in stitcher.overlaps):
                self._due_s = monotonic() + self._pause_s
                self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
        elif not found and settings.auto_calibrate and is_live:
            # What was remembered was forgotten a moment ago; the next group can be measured.
            self._due_s = 0.0
            return
        self._use(images)

    def _calibrate(self, method: str, save: bool) -> list[Overlap]:
        if not self._stitcher.is_complete:
            raise OverlapError('it is not known yet what every camera sees; are all running?')
        groups = self._groups()
        measured = self._stitcher.measure(groups, self.settings, method or self.settings.method)
        former = self._stitcher.overlaps or measured
        self._stitcher.overlaps = [
            new if new.found or not old.found else old
            for new, old in zip(measured, former, strict=True)
        ]
        self._use(groups[-1])
        if save:
            self._write(measured)
        return measured

    def _groups(self) -> list[Group]:
        with self._lock:
            return list(self._recent)

    def _use(self, images: Sequence[np.ndarray]) -> None:
        self.compositor = self._stitcher.compositor(self.settings, images)
        self._changed()

    def _read(self, path: str) -> None:
        try:
            self._stitcher.overlaps = read_overlaps(
                path, self._stitcher.cameras, self._stitcher.surfaces
            )
        except FisheyeError as error:
            self._warn(f'{error}; the overlap is measured instead')

    def _write(self, overlaps: list[Overlap]) -> None:
        path = self.settings.overlap_file
        if not path:
            raise OverlapError(
                'the overlap was measured and is in use, but not saved: overlap_file is empty'
            )
        write_overlaps(path, self._stitcher.cameras, self._stitcher.surfaces, overlaps)
