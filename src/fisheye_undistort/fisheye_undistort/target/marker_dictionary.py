"""OpenCV's dictionaries of markers, by their names."""

import cv2

from fisheye_core.errors import SettingError


def can_read_markers() -> bool:
    """Return whether this OpenCV is built with what reads markers."""
    return hasattr(cv2, 'aruco')


def dictionary_names() -> list[str]:
    """Return OpenCV's names of the dictionaries of markers."""
    return [name for name in dir(getattr(cv2, 'aruco', None)) if name.startswith('DICT_')]


def dictionary_named(name: str):
    """Return one of OpenCV's dictionaries of markers.

    Raises
    ------
    SettingError
        If this OpenCV cannot read markers, or knows none of this name.
    """
    if not can_read_markers():
        raise SettingError(
            f'the target has markers, and OpenCV {cv2.__version__} here is built without them; '
            'expected OpenCV 4.7 or later, the package opencv-contrib-python, or another target'
        )
    if name not in dictionary_names():
        raise SettingError(
            f"dictionary '{name}' is not known; expected one of {', '.join(dictionary_names())}"
        )
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
