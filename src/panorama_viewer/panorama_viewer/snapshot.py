"""One panorama in a file that other programs understand.

As PNG, with what its pixels look at in a JSON file beside it; or as an equirectangular JPEG with
the GPano tags by which viewers of photo spheres know its place on the sphere.
"""

import json
import os
from datetime import datetime, timezone
from pathlib import Path

import cv2
import numpy as np

from fisheye_core.errors import FileAccessError
from fisheye_geometry.surface import Surface
from panorama_viewer.photo_sphere import gpano
from panorama_viewer.projection import Quaternion, described

FORMATS = {'png': '.png', 'gpano': '.jpg'}
"""How a panorama can be saved, and the suffix of the file."""

_SUFFIXES = ('.png', '.jpg', '.jpeg')


def save(
    path: Path,
    form: str,
    image: np.ndarray,
    surface: Surface,
    stamp_ns: int,
    wraps: bool = False,
    orientation: Quaternion | None = None,
) -> list[Path]:
    """Save a panorama.

    Parameters
    ----------
    path
        The file, without or with a suffix of a picture, in whose place that of the format is put;
        or an existing folder.
    form
        One of `FORMATS`.
    image
        (height, width[, 3]) uint8, BGR or grey.
    surface
        What the panorama shows.
    stamp_ns
        When it was taken, ns since 1970.
    wraps
        Whether its right edge meets its left one.
    orientation
        What takes its rays to level ones; None for a level one.

    Returns
    -------
    list of Path
        The files that were written.

    Raises
    ------
    FileAccessError
        If a file cannot be written.
    GeometryError
        If the panorama is wider than 360 degrees, as `gpano`.
    """
    if os.path.isdir(path):
        path /= 'panorama'
    name = path.stem if path.suffix.lower() in _SUFFIXES else path.name
    path = path.with_name(name + FORMATS[form])
    if form == 'gpano':
        return [_write(path, gpano(image, surface, wraps, orientation))]
    description = {
        'image': path.name,
        'stamp_ns': stamp_ns,
        'taken': datetime.fromtimestamp(stamp_ns / 1e9, timezone.utc).isoformat(),
        'projection': described(surface, wraps, orientation),
    }
    text = json.dumps(description, indent=2) + '\n'
    return [
        _write(path, cv2.imencode('.png', image)[1].tobytes()),
        _write(path.with_suffix('.json'), text.encode()),
    ]


def _write(path: Path, content: bytes) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise FileAccessError(path, 'written', error.strerror) from error
    return path
