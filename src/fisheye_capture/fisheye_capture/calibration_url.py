"""Where a camera's calibration is: `camera_info_url` as ROS writes it, or a plain path."""

from pathlib import Path
from urllib.parse import unquote

from ament_index_python.packages import get_package_share_directory

from fisheye_geometry.camera_file import Camera, read_camera
from fisheye_geometry.errors import CameraFileError


def calibration_of(url: str) -> Camera | None:
    """Read the camera that a URL names; None for an empty one.

    Raises
    ------
    CameraFileError
        If the URL means nothing, or its file describes no camera.
    """
    path = calibration_path(url)
    return None if path is None else read_camera(path)


def calibration_path(url: str) -> Path | None:
    """Give the file that a path, a `file://` or a `package://` URL names; None for an empty one.

    Raises
    ------
    CameraFileError
        For another scheme, for a package that is not installed and for a user who is not known.
    """
    if not url:
        return None
    if '\0' in unquote(url):
        raise CameraFileError(f'camera_info_url {url!r} has a zero byte; expected a path or URL')
    scheme, mark, rest = url.partition('://')
    if not mark:
        try:
            return Path(url).expanduser()
        except RuntimeError as error:
            raise CameraFileError(
                f"camera_info_url '{url}' names the home of a user who is not known"
            ) from error
    if scheme == 'file':
        return Path(unquote(rest))
    if scheme != 'package':
        raise CameraFileError(
            f"camera_info_url '{url}' has the scheme '{scheme}'; expected a path, file:// or package://"
        )
    package, _, path = unquote(rest).partition('/')
    try:
        return Path(get_package_share_directory(package), path)
    except (LookupError, ValueError, OSError) as error:
        raise CameraFileError(
            f"camera_info_url '{url}' names the package '{package}', which is not installed"
        ) from error
