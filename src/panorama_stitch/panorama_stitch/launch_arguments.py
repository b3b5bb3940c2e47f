"""What panorama.launch.py takes: its arguments, read and checked."""

import os
from collections.abc import Sequence
from contextlib import suppress
from math import isfinite, radians
from pathlib import Path
from typing import Any

from ament_index_python.packages import get_package_share_directory

from fisheye_core.errors import SettingError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.rig import CAMERA_NAME, MAX_CAMERAS
from panorama_stitch.overlap.saved_rig import saved_rig
from panorama_stitch.pipeline.view_settings import ViewNames

CONFIG = Path(get_package_share_directory('panorama_stitch')) / 'config'
ARGUMENTS = {
    'cameras': ('left,right', 'names of 1 to 8 cameras, from left to right'),
    'composed': ('false', 'one process from cameras to panorama instead of several'),
    'robot': ('false', 'only the captures, on the robot'),
    'base': ('false', 'all but the captures, at the other end of the link'),
    'params_file': (str(CONFIG / 'panorama.yaml'), 'parameters that differ from the defaults'),
    'transport': ('', 'how pictures are taken from topics: raw, compressed or video'),
    'frame_rate_hz': ('', 'frames a second of each camera'),
    'overlap_file': ('', 'where the overlap is read at start and saved on request'),
    'views': ('', 'names of views for detectors, with commas between them: front,rear'),
    'view': ('false', 'also show the panorama in a browser'),
    'host': ('', 'address on which browsers are served; 0.0.0.0 for other machines too'),
    'transforms': ('false', 'also publish where the optical frames of the cameras point'),
    'yaw_deg': ('', 'angle between the cameras; from overlap_file if it is not given'),
    'use_sim_time': ('false', 'go by /clock, as a recording that is played back provides it'),
}
OF_CAMERA = {
    'source': 'what the camera is: device, picture, folder, video or URL',
    'camera_info_url': 'calibration file of the camera',
    'region': "part of the source's frames that the camera is; cameras share it if composed",
}
"""Arguments of each camera, behind its name: `front_source`."""
FLAGS = tuple(name for name, (value, _) in ARGUMENTS.items() if value == 'false')
OF_LAUNCH = ('launch-prefix', 'launch-prefix-filter', 'emulate_tty', 'ros_namespace')
"""What launch itself and launch_ros take beside a file's own arguments."""
YES, NO = ('true', '1', 'yes', 'on'), ('false', '0', 'no', 'off')


def camera_names(text: str) -> list[str]:
    """Read the names of the cameras."""
    names = [name.strip() for name in text.split(',')]
    for name in names:
        if not CAMERA_NAME.fullmatch(name):
            raise SettingError(
                f"cameras has '{name}'; expected names of a letter, then letters, digits or _, "
                'with commas between them'
            )
    if len(set(names)) != len(names) or len(names) > MAX_CAMERAS:
        raise SettingError(f'cameras is {text}; expected 1 to {MAX_CAMERAS} different names')
    return names


def arguments_of(cameras: Sequence[str]) -> dict[str, str]:
    """Return the arguments of cameras, with their descriptions."""
    return {
        f'{camera}_{name}': f'{text} ({camera})'
        for camera in cameras
        for name, text in OF_CAMERA.items()
    }


def check_names(words: Sequence[str], cameras: Sequence[str]) -> None:
    """Refuse arguments of the command line that nobody has."""
    known = (*ARGUMENTS, *arguments_of(cameras))
    for name in (word.partition(':=')[0] for word in words):
        if name not in (*known, *OF_LAUNCH):
            raise SettingError(f"there is no argument '{name}'; expected {', '.join(known)}")


def checked(arguments: dict[str, str], cameras: list[str]) -> dict[str, Any]:
    """Return the arguments, those that are true or false as bool, the cameras as a list."""
    flags = {name: flag(name, arguments[name]) for name in FLAGS}
    paths = {name: os.path.expanduser(arguments[name]) for name in ('params_file', 'overlap_file')}
    if not Path(paths['params_file']).is_file():
        raise SettingError(f"params_file is '{paths['params_file']}', which is not a file")
    rate = arguments['frame_rate_hz']
    rates = {'frame_rate_hz': number('frame_rate_hz', rate)} if rate else {}
    views = [name.strip() for name in arguments['views'].split(',')] if arguments['views'] else []
    ViewNames(tuple(views)).check_views(cameras)  # else the node would, at each of its starts
    # Those of cameras that are not declared are there only if they were given.
    own = {name: arguments.get(name, '') for name in arguments_of(cameras)}
    return {
        **arguments,
        **own,
        **flags,
        **paths,
        **rates,
        'cameras': cameras,
        'views': views or '',
    }


def flag(name: str, text: str) -> bool:
    """Read an argument that is true or false."""
    if text.lower() not in (*YES, *NO):
        raise SettingError(f"{name} is '{text}'; expected true or false")
    return text.lower() in YES


def number(name: str, text: str) -> float:
    """Read an argument that is a number; launch_ros would hand text on as text."""
    with suppress(ValueError):
        if isfinite(value := float(text)):
            return value
    raise SettingError(f"{name} is '{text}'; expected a number")


def attitudes(arguments: dict[str, Any]) -> dict[str, Attitude] | None:
    """Return the attitudes of the cameras as given or measured; None if not measured yet."""
    cameras, path = arguments['cameras'], arguments['overlap_file']
    if arguments['yaw_deg']:
        if len(cameras) != 2:
            raise SettingError(
                f'yaw_deg is the angle between two cameras; there are {len(cameras)} (see '
                'overlap_file)'
            )
        half_rad = radians(number('yaw_deg', arguments['yaw_deg'])) / 2
        return dict(zip(cameras, (Attitude(-half_rad), Attitude(half_rad)), strict=True))
    if not path:
        raise SettingError('transforms:=true needs yaw_deg or overlap_file')
    rig = saved_rig(path, cameras)
    if rig is None:
        return None
    if rig.apart:
        raise SettingError(f'{path} holds no angle between the cameras; give yaw_deg')
    return {camera.name: camera.attitude for camera in rig.cameras}
