"""Look for a target in many pictures at a time."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import islice

import cv2

from fisheye_core.errors import CalibrationError
from fisheye_core.parallel import run_parallel
from fisheye_undistort.detect.detection import Detector
from fisheye_undistort.detect.pictures import NamedPicture
from fisheye_undistort.fit.estimate import TargetView

Found = TargetView | str
"""A view of the target, or why there is none."""


def look(
    pictures: Iterable[NamedPicture], detector: Detector
) -> Iterator[tuple[NamedPicture, Found]]:
    """Look for the target in pictures on all cores; give each with what was found, in order."""
    waiting = iter(pictures)
    while some := list(islice(waiting, max(2, cv2.getNumThreads()))):
        found: list[Found] = [''] * len(some)
        run_parallel([_job(detector, picture, found, i) for i, picture in enumerate(some)])
        yield from zip(some, found, strict=True)


def look_at(picture: NamedPicture, detector: Detector) -> Found:
    """Look for the target in one picture."""
    if picture.problem:
        return picture.problem
    try:
        return detector(picture.name, picture.gray)
    except CalibrationError as error:
        return str(error)


def _job(detector: Detector, picture: NamedPicture, found: list[Found], index: int):
    def job() -> None:
        own = replace(detector, quick=True) if picture.moving else detector
        found[index] = look_at(picture, own)

    return job
