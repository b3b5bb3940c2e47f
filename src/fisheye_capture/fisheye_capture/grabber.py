"""Grabbing: a thread that reads a source for ever, and gets it back when it is lost."""

from collections.abc import Callable
from threading import Event, Thread

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.source import Frame, Source, SourceEndedError, SourceLostError
from fisheye_capture.sources import open_source
from fisheye_core.errors import FisheyeError
from fisheye_core.rate_meter import RateMeter

_FIRST_WAIT_S = 0.25
"""Before the first attempt to reopen; doubled before each further one."""
_STOP_TIMEOUT_S = 1.5


class Grabber:
    """Hands over the frames of a source, and reopens it for as long as it takes.

    Attributes
    ----------
    camera
        What the camera sees, where the source itself knows it.
    reason
        Why there are no frames now; '' while they come.
    attempts
        Vain attempts to open the source since the last frame.
    frames
        Frames handed over so far.
    rate : RateMeter
        Of these frames.
    """

    def __init__(
        self,
        settings: CaptureSettings,
        on_frame: Callable[[Frame], None],
        *,
        on_change: Callable[[str], None] = lambda reason: None,
    ):
        """Open the source; `start` begins to read it.

        Parameters
        ----------
        settings
            What to open.
        on_frame
            Called with each frame in the reading thread; the sooner it returns, the better. A
            `FisheyeError` that it raises is the source's fault, which is opened anew.
        on_change
            Called in the reading thread with `reason` when the frames stop and when they come.

        Raises
        ------
        SourceError
            If the source can give no frame ever; a camera that is not there yet is waited for.
        """
        self._settings = settings
        self._on_frame = on_frame
        self._on_change = on_change
        self.rate = RateMeter()
        self._stopping = Event()
        self._thread = Thread(target=self._run, name=f'grab {settings.camera_name}', daemon=True)
        self.reason = 'waiting for the first picture'
        self.attempts = self.frames = self._told_damaged = 0
        self._source: Source | None = None
        try:
            self._source = open_source(settings)
        except SourceLostError as error:
            self.reason, self.attempts = str(error), 1
        self.camera = self._source.camera if self._source else None

    @property
    def note(self) -> str:
        """What a user should know of how the source was opened."""
        source = self._source  # The reading thread may lose it at any moment.
        return source.note if source else ''

    @property
    def complaint(self) -> str:
        """Why there are no frames now, and what was done about it; '' while they come."""
        reason = self.reason  # The reading thread may change it at any moment.
        return f'{reason} (attempts to reopen: {self.attempts})' if reason else ''

    def news(self, reason: str) -> str:
        """Note that the frames stopped, and why, or with '' that they come."""
        if reason:
            return f'no pictures: {reason}'
        return f'pictures come; {self.note}' if self.note else 'pictures come'

    @property
    def skipped(self) -> int:
        """Frames of the open source that were due while the one before was still in work."""
        source = self._source
        return source.skipped if source else 0

    @property
    def damaged(self) -> int:
        """Frames of the open source that came damaged and were not given."""
        source = self._source
        return source.damaged if source else 0

    def damage(self) -> str:
        """Return what came damaged since this was last asked, in a sentence; '' for nothing."""
        source, former = self._source, self._told_damaged
        self._told_damaged = source.damaged if source else 0
        if source is None or not source.damage or self._told_damaged <= former:
            return ''
        return f'{self._told_damaged - former} {source.damage}'

    def start(self) -> None:
        """Begin to read; tell first why the source could not be opened, if so."""
        if self.attempts:
            self._on_change(self.reason)
        self._thread.start()

    def stop(self) -> None:
        """End at once, whatever the source is doing, and release it."""
        self._stopping.set()
        if source := self._source:
            source.interrupt()
        if self._thread.is_alive():
            self._thread.join(_STOP_TIMEOUT_S)
        elif source:
            source.close()

    def _run(self):
        wait_s: float | None = _FIRST_WAIT_S
        while not self._stopping.is_set():
            frames = self.frames
            try:
                self._source = self._source or open_source(self._settings)
                self._read(self._source)
            except SourceEndedError as error:
                wait_s = None
                self._change(str(error))
            except FisheyeError as error:
                came = self.frames > frames
                self.attempts += not came
                longer_s = _FIRST_WAIT_S if came or wait_s is None else 2 * wait_s
                wait_s = min(longer_s, self._settings.reconnect_max_s)
                self._change(str(error))
            finally:
                self._release()
            self._stopping.wait(wait_s)
        self._release()  # stopped before its first turn

    def _read(self, source):
        while not self._stopping.is_set():
            frame = source.read()
            self._on_frame(frame)
            self.frames += 1
            self.rate.count()
            self.attempts = 0
            self._change('')

    def _change(self, reason):
        if reason != self.reason and not self._stopping.is_set():
            self.reason = reason
            self._on_change(reason)

    def _release(self):
        if self._source:
            self._source.close()
            self._source = None
