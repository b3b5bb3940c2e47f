"""Write what a turn told: a camera_info file for each camera, and the mounts as parameters."""

from collections.abc import Sequence
from math import degrees
from pathlib import Path

import numpy as np

from fisheye_core.errors import FileAccessError, SettingError
from fisheye_core.yaml_file import is_missing, read_text, write_mapping
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_geometry.level import DOWN, levelled
from panorama_stitch.turn.turn_calibration import TurnCalibration

PARAMETERS = 'rig.yaml'
"""Name of the parameter file."""
_FIRST_LINE = 'Written by calibrate_rig, which replaces it: copy it to add parameters.'


def mounts_of(attitudes: np.ndarray) -> list[Attitude]:
    """Return how cameras of attitudes (C, 3, 3) are mounted, yaw 0 midway from first to last."""
    return [Attitude.of(attitude) for attitude in levelled(list(attitudes), 'imu', gravity=DOWN)]


def camera_paths(folder: Path, cameras: Sequence[str]) -> list[Path]:
    """Return the file of each camera in a folder, in which nothing of the user's is lost.

    Raises
    ------
    SettingError
        If it would be overwritten by another one of the rig.
    FileAccessError
        If there are parameters in the folder that `write_rig` did not write.
    """
    owners = {PARAMETERS: 'the parameters'}
    for camera in cameras:
        name = f'{camera.replace("/", "_")}.yaml'
        if name in owners:
            raise SettingError(
                f"camera '{camera}' and {owners[name]} would both be written to {name}; expected "
                'names that differ as files'
            )
        owners[name] = f"camera '{camera}'"
    parameters = folder / PARAMETERS
    if not is_missing(parameters) and not read_text(parameters).startswith(f'# {_FIRST_LINE}\n'):
        raise FileAccessError(
            parameters,
            'written',
            'there is one that calibrate_rig did not write; expected another folder as -o',
        )
    return [folder / name for name in owners if name != PARAMETERS]


def write_rig(folder: Path, calibration: TurnCalibration) -> list[Path]:
    """Write NAME.yaml of each camera, and `PARAMETERS` for the nodes of a panorama.

    Parameters
    ----------
    folder
        Where to; it is there.
    calibration
        What to write.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    SettingError
        As `camera_paths`.
    FileAccessError
        As `camera_paths`, or if one cannot be written.
    """
    state, cameras = calibration.fit.state, calibration.cameras
    paths = camera_paths(folder, cameras)
    for index, (name, path) in enumerate(zip(cameras, paths, strict=True)):
        write_camera(path, Camera(name, state.lens(index, calibration.sizes[index])))
    mounts = {
        f'{name}.{angle}_deg': round(degrees(getattr(mount, f'{angle}_rad')), 3)
        for name, mount in zip(cameras, mounts_of(state.attitudes), strict=True)
        for angle in ('yaw', 'pitch', 'roll')
    }
    urls = {name: path.resolve().as_uri() for name, path in zip(cameras, paths, strict=True)}
    lenses = {f'{name}.camera_info_url': url for name, url in urls.items()}
    nodes: dict[str, dict[str, float | str]] = {}
    nodes |= {f'/**/{name}/capture': {'camera_info_url': url} for name, url in urls.items()}
    nodes |= {'/**/stitch': {**mounts}, '/**/panorama': {**lenses, **mounts}}
    parameters = folder / PARAMETERS
    by_node = {node: {'ros__parameters': told} for node, told in nodes.items()}
    write_mapping(parameters, by_node, _FIRST_LINE)
    return [*paths, parameters]
