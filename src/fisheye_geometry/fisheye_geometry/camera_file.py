"""ROS camera_info YAML: the file that camera_calibration writes and camera_info_url names."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fisheye_geometry.errors import CalibrationError, CameraFileError
from fisheye_geometry.lens import Lens, make_lens
from fisheye_geometry.yaml_file import is_number, read_mapping, shown, write_mapping

_IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Camera:
    """A named, calibrated camera.

    Attributes
    ----------
    name
        The camera's name, '' where the file has none.
    lens
        What it sees.
    rectification
        R of camera_info, nine numbers in row order.
    projection
        P of camera_info, twelve numbers in row order; () for K beside a column of zeros.
    """

    name: str
    lens: Lens
    rectification: tuple[float, ...] = _IDENTITY
    projection: tuple[float, ...] = ()

    def misfit(self, width: int, height: int) -> str:
        """Say why pictures of a size, px, cannot be of this camera; '' if they can."""
        if (self.lens.width, self.lens.height) == (width, height):
            return ''
        return (
            f'the calibration is for {self.lens.width}x{self.lens.height} px; '
            f'the pictures have {width}x{height} px'
        )

    @property
    def projection_matrix(self) -> np.ndarray:
        """P of camera_info, (3, 4) float64."""
        if self.projection:
            return np.array(self.projection).reshape(3, 4)
        return np.hstack([self.lens.matrix, np.zeros((3, 1))])


def read_camera(path: str | Path) -> Camera:
    """Read a camera_info YAML file.

    Raises
    ------
    CameraFileError
        If the file cannot be read, lacks something, or describes no possible camera; the
        sentence names the file, the key, the value and what was expected.
    """
    entries = read_mapping(path)
    try:
        size = [_integer(entries, key) for key in ('image_width', 'image_height')]
        matrix = _numbers(entries, 'camera_matrix', {9})
        distortion = _numbers(entries, 'distortion_coefficients', {0, 4, 5, 8})
        lens = make_lens(_text(entries, 'distortion_model'), *size, matrix, distortion)
        return Camera(
            name=_text(entries, 'camera_name'),
            lens=lens,
            rectification=_numbers(entries, 'rectification_matrix', {9}, _IDENTITY),
            projection=_numbers(entries, 'projection_matrix', {12}, ()),
        )
    except (CalibrationError, CameraFileError) as error:
        raise CameraFileError(f'{path}: {error}') from error


def write_camera(path: str | Path, camera: Camera) -> None:
    """Write a camera_info YAML file that `read_camera` and ROS's own tools read.

    Raises
    ------
    CameraFileError
        If the file cannot be written.
    """
    lens = camera.lens
    write_mapping(
        path,
        {
            'image_width': lens.width,
            'image_height': lens.height,
            'camera_name': camera.name,
            'camera_matrix': _matrix(3, 3, lens.matrix.ravel()),
            'distortion_model': lens.ros_model,
            'distortion_coefficients': _matrix(1, len(lens.distortion), lens.distortion),
            'rectification_matrix': _matrix(3, 3, camera.rectification),
            'projection_matrix': _matrix(3, 4, camera.projection_matrix.ravel()),
        },
    )


def _matrix(rows: int, cols: int, data) -> dict:
    return {'rows': rows, 'cols': cols, 'data': [float(value) for value in data]}


def _integer(entries: dict, key: str) -> int:
    value = entries.get(key)
    if type(value) is not int or not is_number(value):
        raise CameraFileError(f'{key} is {shown(value)}; expected a whole number of pixels')
    return value


def _text(entries: dict, key: str) -> str:
    value = entries.get(key, '')
    if isinstance(value, (list, dict)):
        raise CameraFileError(f'{key} is {shown(value)}; expected text')
    # A name may look like a number.
    return value if isinstance(value, str) else shown(value)


def _numbers(entries: dict, key: str, counts: set[int], default=None) -> tuple[float, ...]:
    """Take `data` of a matrix entry, whose length must be one of `counts`."""
    if key not in entries and default is not None:
        return default
    entry = entries.get(key)
    data = entry.get('data') if isinstance(entry, dict) else None
    if not isinstance(data, list):
        raise CameraFileError(
            f'{key} is {shown(entry)}; expected `rows`, `cols` and `data: [...]`'
        )
    if len(data) not in counts:
        expected = ' or '.join(map(str, sorted(counts)))
        raise CameraFileError(f'{key} has {len(data)} numbers; expected {expected}')
    for value in data:
        if not is_number(value):
            raise CameraFileError(f'{key} holds {shown(value)}; expected finite numbers')
    return tuple(float(value) for value in data)
