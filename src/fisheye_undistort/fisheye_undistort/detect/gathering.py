"""Gather the views of a target from pictures of which some may be of no use."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import islice

from fisheye_core.errors import CalibrationError
from fisheye_undistort.detect.collector import Collector
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.looking import look
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.detect.target_guess import better_layout, guess
from fisheye_undistort.target.target import Target

_FIRST = 6
"""Pictures without the target after which another one is looked for."""
_REMEMBERED = 8
"""Pictures without the target that are kept, to look for another one in them."""


@dataclass(frozen=True)
class Gathered:
    """What pictures hold.

    Attributes
    ----------
    collector
        Of the views in the pictures of the commonest size; the others are skipped by name.
    target
        What they show.
    note
        What the user should know of the target; '' if it is the one that was named.
    """

    collector: Collector
    target: Target
    note: str = ''


def gather(
    read: Callable[[], Iterable[NamedPicture]],
    detector: Detector,
    progress: Callable[[str], None] = lambda line: None,
) -> Gathered:
    """Collect the views of a target from pictures.

    Parameters
    ----------
    read
        Reads the pictures anew each time.
    detector
        Finds the target that was named. If no picture shows it, but another that the same numbers
        may mean, that one is taken.
    progress
        Called with a line after each picture.

    Raises
    ------
    SourceError
        If there are no pictures.
    CalibrationError
        If they do not show the target; the sentence says what they show.
    """
    first = list(islice((picture for picture in read() if not picture.problem), _FIRST))
    asked, seen = detector.target, ''
    if first:
        detector = replace(detector, target=better_layout(first, detector))
        collector, missed = _collect(first, detector, progress)
        if missed and not collector.found_any:
            other, seen = guess(missed, detector)
            detector = replace(detector, target=other or detector.target)
    note = note_of(detector.target, asked)
    collector, missed = _collect(read(), detector, progress)
    if not collector.found_any and seen:
        raise CalibrationError(
            f'the target is in none of {collector.looks} pictures: they show {seen}; expected '
            f'{detector.target}'
        )
    if not note and len(missed) > len(collector.views) > 0:
        _, seen = guess(missed, detector)
        note = f'pictures without the target show {seen}' if seen else ''
    return Gathered(collector, detector.target, note)


def note_of(shown: Target, asked: Target) -> str:
    """Return what the user should know of the target that pictures show."""
    return f'the pictures show {shown}; {asked} was asked for' if shown != asked else ''


def _collect(pictures, detector, progress) -> tuple[Collector, list[NamedPicture]]:
    """Return the collector of the commonest size, and some pictures without the target."""
    collectors: dict[tuple[int, ...], Collector] = {}
    names: dict[tuple[int, ...], list[str]] = {}
    unreadable: dict[str, str] = {}
    missed: list[NamedPicture] = []
    for count, (picture, found) in enumerate(look(pictures, detector), start=1):
        if picture.problem:
            unreadable[picture.name] = picture.problem
        else:
            size = picture.gray.shape[::-1]
            names.setdefault(size, []).append(picture.name)
            collectors.setdefault(size, Collector(detector)).add(picture, found)
            if isinstance(found, str) and len(missed) < _REMEMBERED:
                missed.append(picture)
        views = sum(len(collector.views) for collector in collectors.values())
        progress(f'{count} pictures, {views} views of the target')
    if not collectors:
        reasons = '; '.join(unreadable.values())
        raise CalibrationError(f'there is no picture that can be read: {reasons:.300}')
    size, best = max(collectors.items(), key=lambda item: (len(item[1].views), item[1].looks))
    for other, foreign in names.items():
        if other != size:
            reason = (
                f'has {other[0]}x{other[1]} px; most have {size[0]}x{size[1]} px, and all must '
                'come from one camera'
            )
            best.skipped |= dict.fromkeys(foreign, reason)
    best.skipped |= unreadable
    return best, missed
