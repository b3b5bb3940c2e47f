"""Picture files: which there are in a folder or a glob, and their pixels."""

import os
from collections.abc import Collection
from glob import escape, glob
from pathlib import Path

import numpy as np

from fisheye_core.coded_picture import pixels_of
from fisheye_core.errors import ImageFormatError, SourceError
from fisheye_core.regular_file import NotRegularError, opened_regular

SUFFIXES = frozenset(
    {'.bmp', '.jp2', '.jpeg', '.jpg', '.pbm', '.pgm', '.png', '.ppm', '.tif', '.tiff', '.webp'}
)
_MAX_BYTES = 200_000_000
"""More than the largest picture has that is taken, even if it is not compressed."""


def is_picture(path: str | Path) -> bool:
    """Whether a file is a picture by its name."""
    return Path(path).suffix.lower() in SUFFIXES


def pictures_in(name: str | Path, suffixes: Collection[str] = SUFFIXES) -> list[Path]:
    """Return the pictures in a folder, or those that a glob matches.

    Parameters
    ----------
    name
        Of the folder, or the glob; `**` stands for any folders.
    suffixes
        Of the files to give.

    Returns
    -------
    list of Path
        In the order of their names; empty if there is nothing of that name.

    Raises
    ------
    SourceError
        If there is something, but none of it is a picture.
    """
    is_folder = os.path.isdir(name)
    pattern = str(Path(escape(str(name)), '*')) if is_folder else str(name)
    paths = [Path(path) for path in sorted(glob(pattern, recursive=True))]
    pictures = [path for path in paths if path.suffix.lower() in suffixes]
    if not pictures and (paths or is_folder):
        raise SourceError(f'there is no picture in {name} ({", ".join(sorted(suffixes))})')
    return pictures


def read_picture(path: str | Path, *, grey: bool = False) -> np.ndarray:
    """Read a picture, its pixels as the sensor gave them.

    Parameters
    ----------
    path
        Of the file.
    grey
        Whether it is wanted without colour.

    Returns
    -------
    ndarray
        (height, width, 3) uint8 BGR, or (height, width) uint8.

    Raises
    ------
    SourceError
        If the file cannot be read, or is no picture; the sentence names it.
    """
    try:
        return pixels_of(np.frombuffer(_content(path), np.uint8), grey=grey)
    except NotRegularError as error:
        raise SourceError(f'{path} is not a regular file; expected a picture') from error
    except OSError as error:
        raise SourceError(f'{path} cannot be read: {error.strerror}') from error
    except ImageFormatError as error:
        raise SourceError(f'{path} is not a picture that can be read: {error}') from error


def _content(path: str | Path) -> bytes:
    """Read a regular file of a size that a picture can have; a FIFO or device never ends."""
    with opened_regular(path) as file:
        size = os.fstat(file.fileno()).st_size
        if size > _MAX_BYTES:
            raise SourceError(
                f'{path} has {size / 1e6:.0f} MB; expected a picture of up to '
                f'{_MAX_BYTES / 1e6:.0f} MB'
            )
        return file.read(_MAX_BYTES)
