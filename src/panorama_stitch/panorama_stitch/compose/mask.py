"""Masks: where a camera sees the robot itself."""

from pathlib import Path

import numpy as np

from fisheye_core.errors import ImageFormatError
from fisheye_core.picture_file import read_picture

_WHITE = 128
"""Grey level from which on a pixel of a mask is white."""


def read_mask(path: str | Path, width: int, height: int) -> np.ndarray:
    """Read where a camera sees the robot itself.

    Parameters
    ----------
    path
        Picture that is white there and black elsewhere.
    width, height
        Of the camera's pictures, px.

    Returns
    -------
    ndarray
        (height, width) bool.

    Raises
    ------
    SourceError
        If the file cannot be read, or is no picture.
    ImageFormatError
        If it has another size.
    """
    picture = read_picture(path, grey=True)
    if picture.shape != (height, width):
        raise ImageFormatError(
            f'mask {path} has {picture.shape[1]}x{picture.shape[0]} px; expected {width}x{height} '
            'px, as the pictures of its camera have'
        )
    return picture >= _WHITE
