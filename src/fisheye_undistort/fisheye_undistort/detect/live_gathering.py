"""Gather the views of a target from live pictures, even if it is not the one that was named."""

from collections import deque
from concurrent.futures import Future
from dataclasses import replace

from fisheye_core.background import Background
from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.collector import Collector
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.gathering import Gathered, note_of
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.detect.target_guess import better_layout, guess
from fisheye_undistort.target.target import Target

_FIRST, _LATER = 15, 3
"""Pictures without the target after which another one is looked for, and how many times as many
until it is looked for again: the sheet may come late."""
_REMEMBERED = 4
"""So many of the newest pictures without a new view, and of the first views, are looked at for
another target or layout."""


class LiveGathering:
    """Gathers views as they come; looks for another target in the background.

    Attributes
    ----------
    collector : Collector
        Of the views so far; another one once the target is another.
    """

    def __init__(self, detector: Detector):
        """Begin to look for a detector's target."""
        self._asked, self._detector = detector.target, detector
        self._missed: deque[NamedPicture] = deque(maxlen=_REMEMBERED)
        self._first: list[NamedPicture] = []
        self._misses, self._next = 0, _FIRST
        self._seen = ''
        self._background = Background(lambda error: None)
        self._guess: Future | None = None
        self._is_layout_known = False
        self.collector = Collector(detector)

    def add(self, picture: NamedPicture) -> None:
        """Look at a picture.

        Raises
        ------
        ImageFormatError
            If its size differs from that of the pictures before.
        BugError
            If looking for another target failed as no code expected.
        """
        if self.collector.add(picture):
            self._first.append(replace(picture, moving=False))
        else:
            self._missed.append(picture)
            self._misses += 1
        if self._guess is None:
            self._look_for_another()
        elif self._guess.done():
            self._end_guess(self._guess)

    @property
    def target(self) -> Target:
        """What is looked for now."""
        return self._detector.target

    def progress(self) -> str:
        """Describe how far the collection has come."""
        if self._seen and not self.collector.found_any:
            return f'the pictures show {self._seen}; expected {self.target}'
        return f'{self.collector.progress()}: {self.collector.state or "taken"}'

    def gathered(self) -> Gathered:
        """Return what was gathered.

        Raises
        ------
        CalibrationError
            If the pictures show another target; the sentence names it.
        """
        self._background.stop()
        if self._guess is not None and not self._guess.cancelled():
            self._end_guess(self._guess)
        if self._seen and not self.collector.found_any:
            raise CalibrationError(
                f'the target is in none of {self.collector.looks} pictures: they show '
                f'{self._seen}; expected {self.target}'
            )
        return Gathered(self.collector, self.target, note_of(self.target, self._asked))

    def _look_for_another(self) -> None:
        if len(self._first) < _REMEMBERED:
            if self._misses < self._next:
                return
            self._next *= _LATER
        elif self._is_layout_known:
            return
        else:
            self._is_layout_known = True
        pictures = [*self._first[:_REMEMBERED], *self._missed]
        is_found = self.collector.found_any
        self._guess = self._background.do(_another, pictures, self._detector, is_found)

    def _end_guess(self, guess: Future) -> None:
        """Begin anew with another target and the first views, if there are any."""
        target, self._seen = guess.result()
        self._guess = None
        if target not in (None, self.target):
            self._detector = replace(self._detector, target=target)
            self.collector = Collector(self._detector)
            for picture in self._first:
                self.collector.add(picture)


def _another(
    pictures: list[NamedPicture], detector: Detector, is_found: bool
) -> tuple[Target | None, str]:
    """Return what pictures show, as `guess` does."""
    layout = better_layout(pictures, detector)
    if is_found or layout != detector.target:
        return layout, ''
    return guess(pictures, detector)
