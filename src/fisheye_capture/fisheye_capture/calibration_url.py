"""Where a camera's calibration is: `camera_info_url` as ROS writes it, or a plain path."""

import os
import re
from pathlib import Path
from urllib.parse import unquote

from ament_index_python.packages import get_package_share_directory

from fisheye_core.errors import SettingError
from fisheye_geometry.camera_file import Camera, read_camera

_VARIABLE = re.compile(r'\$\{([^}]*)\}?')


def calibration_of(url: str, name: str) -> Camera | None:
    """Read the camera that a URL names; None for an empty one.

    Raises
    ------
    SettingError
        If the URL means nothing.
    FileAccessError, CameraFileError
        If its file cannot be read, or describes no camera.
    """
    path = calibration_path(url, name)
    return None if path is None else read_camera(path)


def calibration_path(url: str, name: str) -> Path | None:
    """Return the file that a path, a `file://` or a `package://` URL names; None for an empty one.

    Parameters
    ----------
    url
        `${NAME}` and `${ROS_HOME}` stand for what camera_info_manager puts there.
    name
        Of the camera.

    Raises
    ------
    SettingError
        For another scheme or variable, for a package that is not installed and for a user who is
        not known.
    """
    if not url:
        return None
    if '\0' in unquote(url):
        raise SettingError(f'camera_info_url {url!r} has a zero byte; expected a path or URL')
    scheme, mark, rest = url.partition('://')
    try:
        if not mark:
            return Path(_filled_in(url, name)).expanduser()
        rest = _filled_in(unquote(rest), name)
    except RuntimeError as error:
        raise SettingError(
            f"camera_info_url '{url}' names the home of a user who is not known"
        ) from error
    if scheme == 'file':
        return Path(rest)
    if scheme != 'package':
        raise SettingError(
            f"camera_info_url '{url}' has the scheme '{scheme}'; expected a path, file:// or package://"
        )
    package, _, path = rest.partition('/')
    try:
        return Path(get_package_share_directory(package), path)
    except (LookupError, ValueError, OSError) as error:
        raise SettingError(
            f"camera_info_url '{url}' names the package '{package}', which is not installed"
        ) from error


def _filled_in(text: str, name: str) -> str:
    def value(found: re.Match) -> str:
        if found[0] == '${NAME}':
            return name
        if found[0] == '${ROS_HOME}':
            return os.environ.get('ROS_HOME') or str(Path.home() / '.ros')
        raise SettingError(
            f'camera_info_url has {found[0]}; expected ${{ROS_HOME}}, ${{NAME}} or none'
        )

    return _VARIABLE.sub(value, text)
