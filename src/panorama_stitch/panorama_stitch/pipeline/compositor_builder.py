"""CompositorBuilder: overlaps measured and compositors built, while frames go on with the former."""

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from threading import Lock
from time import monotonic
from typing import NamedTuple

from fisheye_core.background import Background
from fisheye_core.errors import FisheyeError, OverlapError
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.overlap.overlap_file import read_overlaps, write_overlaps
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings
from panorama_stitch.pipeline.rig_state import Group, RigState

_REMEMBERED = 5
"""Pairs that an overlap is measured on."""
_BETWEEN_REMEMBERED_S = 0.2
_FIRST_PAUSE_S, _LONGEST_PAUSE_S = 2.0, 60.0
"""Between two tries to find an overlap."""


class _Remembered(NamedTuple):
    """Pictures of all cameras, and when the oldest of them was taken."""

    images: Group
    stamp_ns: int


class CompositorBuilder:
    """Keeps the compositor fit for the cameras, the settings and the overlaps.

    Attributes
    ----------
    compositor : Compositor or None
        In use now.
    settings : PanoramaOutputSettings
        Used the next time; `renew` says that it is due.
    trouble : str
        Why there is no newer compositor; '' if there is nothing wrong.
    """

    def __init__(
        self,
        stitcher: RigState,
        settings: PanoramaOutputSettings,
        changed: Callable[[int], None],
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
            Called with the stamp, ns, of the pictures from which a new compositor is in use.
        warn
            Called with a sentence about what did not work.
        """
        self.compositor: Compositor | None = None
        self.settings = settings
        self.trouble = ''
        self._stitcher = stitcher
        self._changed, self._warn = changed, warn
        self._background = Background(self._failed)
        self._lock = Lock()
        self._recent: deque[_Remembered] = deque(maxlen=_REMEMBERED)
        self._remembered_s = 0.0
        self._due_s = 0.0
        self._pause_s = _FIRST_PAUSE_S
        self._job: Future | None = None

    def remember(self, images: Group, stamp_ns: int) -> None:
        """Take a group into account the next time that an overlap is measured."""
        now = monotonic()
        with self._lock:
            is_first = not self._recent
            if is_first:
                self._due_s = 0.0
            if is_first or now - self._remembered_s >= _BETWEEN_REMEMBERED_S:
                self._remembered_s = now
                self._recent.append(_Remembered(images, stamp_ns))

    def renew(self, *, forget: bool) -> None:
        """Have a new compositor built soon; `forget` what the cameras showed so far."""
        if forget:
            with self._lock:
                self._recent.clear()
        self._due_s = 0.0

    def start_pending_job(self, images: Group, stamp_ns: int, *, is_live: bool) -> None:
        """Start what is due, unless something is in work; `is_live`: no picture is stale."""
        busy = self._job is not None and not self._job.done()
        if not busy and self._stitcher.is_complete and monotonic() >= self._due_s:
            self._due_s = float('inf')
            self._job = self._background.do(self._prepare, _Remembered(images, stamp_ns), is_live)

    def calibrate(self, method: str, save: bool) -> Future:
        """Measure the overlaps anew on the groups that are remembered.

        Parameters
        ----------
        method
            One of `METHODS`; '' for that of the settings.
        save
            Also write the result to the overlap file, if all were found.

        Returns
        -------
        Future
            Of a list of `Overlap`. Where no overlap is found, or none that can be believed, one
            that was found before stays in use. With a `FisheyeError` nothing has changed.
        """
        return self._background.do(self._calibrate, method, save)

    def stop(self) -> None:
        """End the thread."""
        self._background.stop()

    def _failed(self, error: FisheyeError) -> None:
        self.trouble = str(error)
        self._warn(self.trouble)
        self._wait(_FIRST_PAUSE_S)

    def _wait(self, pause_s: float) -> None:
        """Try again after a pause, or sooner where something was changed meanwhile."""
        self._due_s = min(self._due_s, monotonic() + pause_s)

    def _prepare(self, newest: _Remembered, is_live: bool) -> None:
        """Find overlaps if there are none, and build the compositor that uses them."""
        stitcher, settings = self._stitcher, self.settings
        if stitcher.overlaps is None:
            self._read(settings.overlap_file)
        found = stitcher.overlaps and all(overlap.found for overlap in stitcher.overlaps)
        groups = self._groups()
        if not found and settings.auto_calibrate and groups:
            surfaces = stitcher.surfaces
            overlaps = self._measured(groups, settings.method)
            if not stitcher.set_overlaps(overlaps, surfaces):
                self._due_s = 0.0
                return
            if not all(overlap.found for overlap in overlaps):
                self._wait(self._pause_s)
                self._pause_s = min(2 * self._pause_s, _LONGEST_PAUSE_S)
        elif not found and settings.auto_calibrate and is_live:
            # What was remembered was forgotten a moment ago; the next group can be measured.
            self._due_s = 0.0
            return
        self._use(newest)

    def _calibrate(self, method: str, save: bool) -> list[Overlap]:
        stitcher, settings = self._stitcher, self.settings
        if not stitcher.is_complete:
            raise OverlapError('it is not known yet what every camera sees; are all running?')
        if save and not settings.overlap_file:
            raise OverlapError('overlap_file is empty; expected the file to save the overlap in')
        groups, surfaces = self._groups(), stitcher.surfaces
        measured = self._measured(groups, method or settings.method)
        if settings.method != 'paper':
            pairs = zip(measured, surfaces[:-1], strict=True)
            measured = [_believed(new, surface, settings.min_confidence) for new, surface in pairs]
        former = stitcher.overlaps or measured
        overlaps = [
            new if new.found or not old.found else old
            for new, old in zip(measured, former, strict=True)
        ]
        if save and all(overlap.found for overlap in measured):
            write_overlaps(settings.overlap_file, stitcher.cameras, surfaces, overlaps)
        if not stitcher.set_overlaps(overlaps, surfaces):
            raise OverlapError('the cameras changed meanwhile; expected them to stay as they are')
        self._use(groups[-1])
        return measured

    def _groups(self) -> list[_Remembered]:
        with self._lock:
            return list(self._recent)

    def _measured(self, groups: list[_Remembered], method: str) -> list[Overlap]:
        pictures = [group.images for group in groups]
        overlaps = self._stitcher.measure(pictures, self.settings, method)
        return [replace(overlap, stamp_ns=groups[-1].stamp_ns) for overlap in overlaps]

    def _use(self, newest: _Remembered) -> None:
        self.compositor = self._stitcher.compositor(self.settings, newest.images)
        self.trouble = ''
        self._changed(newest.stamp_ns)

    def _read(self, path: str) -> None:
        stitcher = self._stitcher
        surfaces = stitcher.surfaces
        try:
            if overlaps := read_overlaps(path, stitcher.cameras, surfaces):
                stitcher.set_overlaps(overlaps, surfaces)
        except FisheyeError as error:
            self._warn(f'{error}; the overlap is measured instead')


def _believed(result: Overlap, left: Surface, needed: float) -> Overlap:
    """Return a result as it is, or as not found where its confidence is less than is needed.

    The published rule always names an offset: asked for once, it must not ruin a rig that runs.
    """
    if not result.found or result.confidence >= needed:
        return result
    message = (
        f'{result.message}; not used: its confidence is {result.confidence:.2f}, '
        f'{needed:.2f} is needed (with the parameter method:=paper it is used all the same)'
    )
    aside = side_by_side(left, result.method, message)
    return replace(
        result,
        found=False,
        offset_x_px=aside.offset_x_px,
        offset_y_px=aside.offset_y_px,
        overlap_px=aside.overlap_px,
        message=message,
    )
