"""Calibration files: camera_info YAML as ROS writes it, and what else ROS tools leave behind.

Beside the file that camera_calibration writes and `camera_info_url` names: its INI form, a message
of camera_info as `ros2 topic echo` prints it, and OpenCV's FileStorage with the keys of ROS.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fisheye_core.errors import (
    CalibrationError,
    CameraFileError,
    FileAccessError,
    FileContentError,
)
from fisheye_core.plain_yaml import Mapping, parse_mapping
from fisheye_core.yaml_file import is_number, read_text, shown, write_mapping
from fisheye_geometry.calibration_ini import is_ini, parse_ini
from fisheye_geometry.camera import IDENTITY, Camera, Readout, camera_from
from fisheye_geometry.lens import make_lens

__all__ = ['Camera', 'check_camera_name', 'read_camera', 'write_camera']

_MATRICES = {
    'k': 'camera_matrix',
    'd': 'distortion_coefficients',
    'r': 'rectification_matrix',
    'p': 'projection_matrix',
}
_KEYS = {
    'width': 'image_width',
    'height': 'image_height',
    **_MATRICES,
    **{key.upper(): name for key, name in _MATRICES.items()},
}
"""Fields of a CameraInfo message (in capitals: of ROS 1), by the file's keys for them."""
_COEFFICIENTS = {0, 4, 5, 8, 12, 14}


def read_camera(path: str | Path) -> Camera:
    """Read a calibration file.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    CameraFileError
        If it lacks something, or describes no possible camera; the sentence names the file, the
        key, the value and what was expected.
    """
    try:
        text = read_text(path)
        return _camera(parse_ini(text) if is_ini(text) else parse_mapping(text))
    except FileContentError as error:
        raise CameraFileError(error.reason, path) from error
    except CalibrationError as error:
        raise CameraFileError(error, path) from error


def write_camera(path: str | Path, camera: Camera, comment: str = '') -> None:
    """Write a camera_info YAML file that `read_camera` and ROS's own tools read.

    Parameters
    ----------
    path
        Where to.
    camera
        What.
    comment
        Lines that stand before it.

    Raises
    ------
    FileAccessError
        If the file cannot be written, or its name says that it is an INI file.
    """
    check_camera_name(path)
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
        comment,
    )


def check_camera_name(path: str | Path) -> None:
    """Refuse a name by which `write_camera` cannot write.

    Raises
    ------
    FileAccessError
        If it says that it is an INI file.
    """
    if Path(path).suffix.lower() == '.ini':
        raise FileAccessError(path, 'written as INI', 'expected a name with .yaml')


def _matrix(rows: int, cols: int, data: Iterable[float]) -> dict[str, Any]:
    return {'rows': rows, 'cols': cols, 'data': [float(value) for value in data]}


def _camera(entries: Mapping) -> Camera:
    _refuse_kalibr(entries)
    if 'image_width' not in entries and 'width' in entries:
        entries = _of_message(entries)
    width, height = _integer(entries, 'image_width'), _integer(entries, 'image_height')
    matrix = _numbers(entries, 'camera_matrix', {9})
    distortion = _numbers(entries, 'distortion_coefficients', _COEFFICIENTS)
    lens = make_lens(_model(entries), width, height, matrix, distortion)
    rectification = _numbers(entries, 'rectification_matrix', {9}, IDENTITY)
    projection = _numbers(entries, 'projection_matrix', {12}, ())
    camera = camera_from(_text(entries, 'camera_name'), lens, rectification, projection)
    return _readout(entries).of(camera)


def _refuse_kalibr(entries: Mapping) -> None:
    first = next(iter(entries.values()), None)
    if isinstance(first, Mapping) and 'intrinsics' in first:
        raise CameraFileError(
            'it is a camchain of Kalibr; expected a camera_info file for each camera: '
            'image_width, image_height, camera_matrix (fx, 0, cx, 0, fy, cy, 0, 0, 1 of '
            'intrinsics), distortion_model, distortion_coefficients'
        )


def _of_message(fields: Mapping) -> Mapping:
    """Return the entries that a message of camera_info says, by the keys of a file."""
    entries = Mapping()
    for field, value in fields.items():
        key = _KEYS.get(field, field)
        entries[key] = {'data': value} if field.lower() in _MATRICES else value
        entries.lines[key] = fields.lines[field]
        if field in fields.texts:
            entries.texts[key] = fields.texts[field]
    return entries


def _readout(entries: Mapping) -> Readout:
    """Return the part of the sensor that an echoed message names; all of it of a file."""
    roi = entries.get('roi', Mapping())
    if not isinstance(roi, Mapping):
        raise CameraFileError(f'{entries.at("roi")}roi is {shown(roi)}; expected x_offset: ...')
    parts = {key: _count(roi, key) for key in ('x_offset', 'y_offset', 'width', 'height')}
    return Readout(**parts, **{key: _count(entries, key) for key in ('binning_x', 'binning_y')})


def _count(entries: Mapping, key: str) -> int:
    value = _integer(entries, key) if key in entries else 0
    if value < 0:
        raise CameraFileError(f'{entries.at(key)}{key} is {value}; expected 0 or more')
    return value


def _integer(entries: Mapping, key: str) -> int:
    value: Any = entries.get(key)
    if not is_number(value) or value != int(value):
        raise CameraFileError(
            f'{entries.at(key)}{key} is {shown(value)}; expected a whole number of pixels'
        )
    return int(value)


def _model(entries: Mapping) -> str:
    if 'distortion_model' not in entries and 'camera_model' in entries:
        raise CameraFileError(
            f'{entries.at("camera_model")}camera_model is {shown(entries["camera_model"])}, and '
            'distortion_model is missing; expected distortion_model: equidistant (of a fisheye '
            'lens), plumb_bob or rational_polynomial'
        )
    return _text(entries, 'distortion_model')


def _text(entries: Mapping, key: str) -> str:
    if key in entries and key not in entries.texts:
        raise CameraFileError(
            f'{entries.at(key)}{key} is {shown(entries[key])}; expected text, in quotes if it has '
            'brackets'
        )
    return entries.texts.get(key, '')


def _numbers(
    entries: Mapping, key: str, counts: set[int], default: tuple[float, ...] | None = None
) -> tuple[float, ...]:
    """Read `data` of a matrix entry, whose length must be one of `counts`."""
    if key not in entries and default is not None:
        return default
    entry, name = entries.get(key), entries.at(key) + key
    data = entry.get('data') if isinstance(entry, dict) else None
    if not isinstance(data, list):
        raise CameraFileError(
            f'{name} is {shown(entry)}; expected `rows`, `cols` and `data: [...]`'
        )
    if data and all(isinstance(row, list) for row in data):
        data = [value for row in data for value in row]
    for value in data:
        if not is_number(value):
            raise CameraFileError(
                f'{name} holds {shown(value)}; expected finite numbers, with commas between them'
            )
    if len(data) not in counts:
        expected = ' or '.join(map(str, sorted(counts)))
        raise CameraFileError(f'{name} has {len(data)} numbers; expected {expected}')
    return tuple(float(value) for value in data)
