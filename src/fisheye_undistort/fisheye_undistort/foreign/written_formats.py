"""Calibration files that other programs read."""

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from fisheye_core.errors import FileAccessError
from fisheye_core.regular_file import check_replaceable, replace_regular
from fisheye_core.yaml_file import write_mapping
from fisheye_geometry.camera_file import Camera, check_camera_name, write_camera


def write_as(kind: str, path: Path, camera: Camera, comment: str = '') -> None:
    """Write a calibration as one of `FORMATS`; `comment` lines stand before it.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    _WRITERS[kind](path, camera, comment)


def check_output(kind: str, path: Path) -> None:
    """Refuse, before there is a calibration, what `write_as` cannot write.

    Raises
    ------
    FileAccessError
        As `write_as`.
    """
    if kind == 'ros':
        check_camera_name(path)
    try:
        check_replaceable(path)
    except OSError as error:
        raise FileAccessError(path, 'written', error.strerror) from error


def _kalibr(path: Path, camera: Camera, comment: str) -> None:
    """Write a camchain of Kalibr with one camera."""
    lens = camera.lens
    intrinsics = [lens.focal_x_px, lens.focal_y_px, lens.center_x_px, lens.center_y_px]
    entry = {
        'camera_model': 'pinhole',
        'intrinsics': intrinsics,
        'distortion_model': 'equidistant',
        'distortion_coeffs': list(lens.distortion),
        'resolution': [lens.width, lens.height],
        'rostopic': f'/{camera.name}/image_raw',
    }
    write_mapping(path, {'cam0': entry}, comment)


def _opencv(path: Path, camera: Camera, comment: str) -> None:
    """Write OpenCV's FileStorage, for `cv::fisheye`."""
    lens = camera.lens
    storage = cv2.FileStorage('.yml', cv2.FILE_STORAGE_WRITE + cv2.FILE_STORAGE_MEMORY)
    for line in comment.splitlines():
        storage.writeComment(line)
    storage.write('image_width', lens.width)
    storage.write('image_height', lens.height)
    storage.write('fisheye_model', 1)
    storage.write('camera_matrix', lens.matrix)
    storage.write('distortion_coefficients', np.array(lens.distortion))
    try:
        replace_regular(path, storage.releaseAndGetString())
    except OSError as error:
        raise FileAccessError(path, 'written', error.strerror) from error


_WRITERS: dict[str, Callable[[Path, Camera, str], None]] = {
    'ros': write_camera,
    'kalibr': _kalibr,
    'opencv': _opencv,
}
FORMATS = tuple(_WRITERS)
