"""Calibration files of other programs: Kalibr, OCamCalib, OpenCV, mrcal."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from fisheye_core.errors import CalibrationError, CameraFileError, FileContentError
from fisheye_core.plain_yaml import parse_mapping
from fisheye_core.yaml_file import read_text
from fisheye_geometry.camera_file import read_camera
from fisheye_undistort.foreign import foreign_models as models
from fisheye_undistort.foreign.lens_samples import Samples, samples_of_ocam, samples_of_projection

_KNOWN = (
    "Kalibr's camchain, OCamCalib's calib_results.txt, OpenCV's FileStorage, mrcal's .cameramodel "
    'or camera_info'
)
_MAX_BYTES = 10_000_000
"""What mrcal fitted a lens to stands in its file, too."""
_MATRIX = ('camera_matrix', 'cameramatrix', 'k')
"""Keys of OpenCV's matrix, in small letters."""


def read_foreign(path: str | Path, camera: str = '') -> tuple[Samples, str]:
    """Read a calibration of another program.

    Parameters
    ----------
    path
        Of the file.
    camera
        Which one of a file that holds several: its name; '1' or '2' of an OpenCV stereo pair.

    Returns
    -------
    samples : Samples
        What the lens does.
    name : str
        Of the model.

    Raises
    ------
    FileAccessError
        If the file cannot be read.
    CameraFileError
        If it is of no known kind, describes no lens, or several and not the one that was named;
        the sentence names the file.
    """
    text = read_text(path, _MAX_BYTES)
    read = next(read for sign, read in _READERS if re.search(sign, text, re.MULTILINE))
    try:
        if camera and read not in (_kalibr, _opencv):
            raise CalibrationError(f"it names no cameras of which one could be '{camera}'")
        return read(text, path, camera)
    except CameraFileError:
        raise
    except (FileContentError, CalibrationError) as error:
        raise CameraFileError(error, path) from error
    except (LookupError, TypeError, ValueError, SyntaxError, SystemError, cv2.error) as error:
        # OpenCV's constructors raise their cv2.error as a SystemError.
        raise CameraFileError(
            f'it lacks something ({error!r:.80}); expected {_KNOWN}', path
        ) from error


def _chosen(cameras: dict[str, Any], camera: str) -> Any:
    """Return the camera of a name; '' means the only one."""
    if not camera and len(cameras) == 1:
        return next(iter(cameras.values()))
    if camera not in cameras:
        *_, last = cameras
        raise CalibrationError(f'it holds {", ".join(cameras)}; choose one with --camera {last}')
    return cameras[camera]


def _kalibr(text: str, path: str | Path, camera: str) -> tuple[Samples, str]:
    chain = {
        name: entry
        for name, entry in parse_mapping(text).items()
        if isinstance(entry, dict) and 'camera_model' in entry
    }
    entry = _chosen(chain, camera)
    model, distortion = entry['camera_model'], entry.get('distortion_model', 'none')
    width, height = entry['resolution']
    numbers = [float(value) for value in entry['intrinsics']]
    extra = [float(value) for value in entry.get('distortion_coeffs', [])]
    if (model, distortion) == ('pinhole', 'equidistant'):
        fx, fy, cx, cy = numbers
        project = models.fisheye(fx, fy, cx, cy, extra)
    elif model in ('ds', 'eucm'):
        project = {'ds': models.double_sphere, 'eucm': models.extended_unified}[model](*numbers)
    elif model in ('pinhole', 'omni') and distortion in ('radtan', 'none'):
        make: Any = {'pinhole': models.pinhole, 'omni': models.unified}[model]
        project = make(*numbers, models.radial_tangential(extra))
    else:
        raise CalibrationError(
            f'its model is {model} with {distortion}; expected pinhole, omni, ds or eucm with '
            'radtan, equidistant or none'
        )
    return samples_of_projection(project, (int(width), int(height))), f'{model} {distortion}'


def _ocam(text: str, path: str | Path, camera: str) -> tuple[Samples, str]:
    rows = [line.split() for line in text.splitlines() if line.strip() and line[0] != '#']
    numbers = [[float(value) for value in row] for row in rows]
    count, *polynomial = numbers[0]
    if int(count) != len(polynomial):
        raise CalibrationError(f'{len(polynomial)} coefficients; expected {count:.0f}')
    row, column = numbers[2]
    c, d, e = numbers[3]
    height, width = numbers[4]
    size = (int(width), int(height))
    return samples_of_ocam(polynomial, (row, column), (c, d, e), size), 'OCam'


def _mrcal(text: str, path: str | Path, camera: str) -> tuple[Samples, str]:
    fields = ast.literal_eval(text.strip())
    model, (width, height) = fields['lensmodel'], fields['imagersize']
    fx, fy, cx, cy, *extra = map(float, fields['intrinsics'])
    name = model.removeprefix('LENSMODEL_')
    if name == 'STEREOGRAPHIC':
        project = models.stereographic(fx, fy, cx, cy)
    elif name == 'PINHOLE' or name.startswith('OPENCV'):
        project = models.pinhole(fx, fy, cx, cy, models.radial_tangential(extra))
    elif name.startswith('SPLINED_STEREOGRAPHIC'):
        said = dict(re.findall(r'(order|Nx|Ny|fov_x_deg)=([\d.]+)', name))
        shifts = np.reshape(extra, (int(said['Ny']), int(said['Nx']), 2))
        fov = np.radians(float(said['fov_x_deg']))
        project = models.splined_stereographic(fx, fy, cx, cy, shifts, int(said['order']), fov)
    else:
        raise CalibrationError(
            f'its model is {model}; expected LENSMODEL_PINHOLE, STEREOGRAPHIC, OPENCV4 to 12 or '
            'SPLINED_STEREOGRAPHIC'
        )
    return samples_of_projection(project, (int(width), int(height))), name


def _opencv(text: str, path: str | Path, camera: str) -> tuple[Samples, str]:
    storage = cv2.FileStorage(text, cv2.FILE_STORAGE_READ + cv2.FILE_STORAGE_MEMORY)
    found = _chosen(_opencv_cameras(storage.root()), camera)
    matrix = _first(found, _MATRIX).mat()
    coefficients = _first(found, ('distortion_coefficients', 'distcoeffs', 'd')).mat().ravel()
    size = _size(found)
    fx, fy, cx, cy = matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]
    flag = found.get('fisheye_model')
    is_fisheye = bool(flag.real()) if flag is not None else len(coefficients) == 4
    if is_fisheye:
        project = models.fisheye(fx, fy, cx, cy, coefficients.tolist())
    else:
        project = models.pinhole(fx, fy, cx, cy, models.radial_tangential(coefficients.tolist()))
    name = 'OpenCV fisheye' if is_fisheye else 'OpenCV pinhole'
    return samples_of_projection(project, size), name


def _opencv_cameras(root) -> dict[str, dict[str, Any]]:
    """Return the nodes of each camera: of every part with a matrix, or of K1 D1 and K2 D2."""
    shared = _nodes(root)
    cameras = {name: _nodes(part) for name, part in _parts(root) if {*_MATRIX} & {*_keys(part)}}
    if not cameras:
        numbers = [number for number in '12' if f'k{number}' in shared]
        cameras = {n: {'k': shared[f'k{n}'], 'd': shared[f'd{n}']} for n in numbers}
    return {name: {**shared, **camera} for name, camera in cameras.items()} or {'1': shared}


def _parts(node, *path: str) -> Iterator[tuple[str, Any]]:
    """Yield all nodes of a storage by their names, outer ones first, and none of matrices."""
    yield '.'.join(path) or '1', node
    for key in _keys(node).values():
        child = node.getNode(key)
        if 'data' not in _keys(child):
            yield from _parts(child, *path, key)


def _nodes(node) -> dict[str, Any]:
    """Return all nodes of a storage by their keys in small letters, outer ones first."""
    found: dict[str, Any] = {}
    for _, part in _parts(node):
        for small, key in _keys(part).items():
            found.setdefault(small, part.getNode(key))
    return found


def _keys(node) -> dict[str, str]:
    """Return the keys of a node, by the same in small letters; there are none if it is no map."""
    return {key.lower(): key for key in node.keys()} if node.isMap() else {}  # noqa: SIM118


def _first(found: dict[str, Any], names: tuple[str, ...]):
    for name in names:
        if name in found:
            return found[name]
    raise CalibrationError(f'it has none of {", ".join(names)}')


def _size(found: dict[str, Any]) -> tuple[int, int]:
    for width, height in (('image_width', 'image_height'), ('width', 'height')):
        if width in found and height in found:
            return int(found[width].real()), int(found[height].real())
    for name in ('image_size', 'imagesize', 'resolution', 'size'):
        if name in found and found[name].isSeq():
            return int(found[name].at(0).real()), int(found[name].at(1).real())
    raise CalibrationError(
        'it does not say the size of the picture; add image_width, image_height'
    )


def _camera_info(text: str, path: str | Path, camera: str) -> tuple[Samples, str]:
    lens = read_camera(path).lens

    def project(rays):
        pixels, seen = lens.project(rays)
        return np.where(seen[..., None], pixels, np.nan)

    return samples_of_projection(project, (lens.width, lens.height)), lens.model


_READERS = (
    (r'^[ \t]*[\'"]?lensmodel[\'"]?\s*:', _mrcal),
    (r'^[ \t]+camera_model\s*:', _kalibr),
    (r'^#.*polynomial coefficients', _ocam),
    (r'^%YAML|<opencv_storage>', _opencv),
    ('', _camera_info),
)
"""Signs by which a file is known, and what reads it; the first that fits counts."""
