"""Read the pictures that a calibration is made from: files, folders, globs and videos."""

import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from fisheye_core.encodings import from_opencv
from fisheye_core.errors import SourceError
from fisheye_core.picture_file import SUFFIXES, is_picture, pictures_in, read_picture

HALVES = ('left', 'right')

_VIDEOS = frozenset({'.mp4', '.avi', '.mkv', '.mov', '.webm', '.m4v', '.mjpg', '.mjpeg'})
"""What is taken from a folder or glob besides pictures."""
_FOREIGN = frozenset({'.heic', '.heif', '.avif'})
"""Pictures that telephones leave in a folder; most cannot be read, and that is said."""
_TAKEN = SUFFIXES | _VIDEOS | _FOREIGN
_LOOKS_PER_SECOND = 10
"""Frames of a video that are looked at; a hand does not hold a sheet still for less."""


@dataclass(frozen=True)
class NamedPicture:
    """A picture and what to call it.

    Attributes
    ----------
    name
        File name, of a video with the frame's number.
    gray
        (height, width) uint8.
    moving
        Whether it is one of a sequence, in which the target may be on its way.
    problem
        Why there are no pixels, '' if there are.
    """

    name: str
    gray: np.ndarray
    moving: bool = False
    problem: str = ''


def read_pictures(paths: Iterable[str | Path], half: str = '') -> Iterator[NamedPicture]:
    """Read pictures one after another.

    Parameters
    ----------
    paths
        Pictures, folders of pictures, globs, videos.
    half
        `left` or `right` of pictures that a stereo camera puts side by side; '' for all of it.

    Raises
    ------
    SourceError
        If there is nothing; what is there and cannot be read is a picture with a `problem`.
    """
    for path in _expand(paths):
        pictures = _picture(path) if _is_picture(path) else _frames(path)
        try:
            for picture in pictures:
                yield replace(picture, gray=cut(picture.gray, half))
        except SourceError as error:
            yield NamedPicture(path.name, np.empty((0, 0), np.uint8), problem=str(error))


def _is_picture(path: Path) -> bool:
    return is_picture(path) or path.suffix.lower() in _FOREIGN


def cut(gray: np.ndarray, half: str) -> np.ndarray:
    """Return one half of a side-by-side picture, or all of it."""
    middle = gray.shape[1] // 2
    parts = {'': gray, 'left': gray[:, :middle], 'right': gray[:, middle:]}
    return np.ascontiguousarray(parts[half])


def _expand(paths: Iterable[str | Path]) -> list[Path]:
    found = []
    for path in paths:
        inside = [Path(path)] if os.path.isfile(path) else pictures_in(path, _TAKEN)
        if not inside:
            raise SourceError(f'{path} is not there, neither a file nor a folder nor a glob')
        found += inside
    return found


def _picture(path: Path) -> Iterator[NamedPicture]:
    yield NamedPicture(path.name, read_picture(path, grey=True))


def _frames(path: Path) -> Iterator[NamedPicture]:
    video = cv2.VideoCapture(str(path))
    try:
        rate = video.get(cv2.CAP_PROP_FPS)
        step = max(1, round(rate / _LOOKS_PER_SECOND)) if 0 < rate < 1000 else 1
        number = 0
        while video.grab():
            if number % step == 0:
                read, frame = video.retrieve()
                if not read:
                    break
                gray = from_opencv(frame, 'mono8')
                yield NamedPicture(f'{path.name} frame {number}', gray, moving=True)
            number += 1
    finally:
        video.release()
    if number == 0:
        raise SourceError(f'{path} is not a video that can be read')
