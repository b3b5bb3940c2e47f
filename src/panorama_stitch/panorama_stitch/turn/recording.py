"""Read what the cameras of a rig recorded: folders, globs or videos, picture after picture."""

from collections.abc import Iterator, Mapping

import numpy as np

from fisheye_core.errors import SourceError
from fisheye_undistort.detect.pictures import NamedPicture, read_pictures

_END = object()


def read_recording(sources: Mapping[str, str]) -> Iterator[tuple[np.ndarray, ...]]:
    """Read the pictures of all cameras that belong together: the first of each, the second, ...

    Parameters
    ----------
    sources
        A folder, glob or video by the name of each camera.

    Yields
    ------
    tuple of ndarray
        One (height, width) uint8 a camera.

    Raises
    ------
    SourceError
        If something cannot be read, or the cameras have not the same number of pictures.
    """
    streams = {name: read_pictures([source]) for name, source in sources.items()}
    number = 0
    while True:
        pictures = {name: next(stream, _END) for name, stream in streams.items()}
        ended = [name for name, picture in pictures.items() if picture is _END]
        if len(ended) == len(pictures):
            return
        if ended:
            others = ', '.join(name for name in pictures if name not in ended)
            raise SourceError(
                f'{", ".join(ended)} has {number} pictures and {others} more; expected as many of '
                'each camera, taken at the same times'
            )
        number += 1
        read = [each for each in pictures.values() if isinstance(each, NamedPicture)]
        for each in read:
            if each.problem:
                raise SourceError(each.problem)
        yield tuple(each.gray for each in read)
