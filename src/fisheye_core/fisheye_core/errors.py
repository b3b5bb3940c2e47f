"""Every error this project raises on purpose: one root, a family for each kind of cause."""

from pathlib import Path
from typing import Any


class FisheyeError(Exception):
    """Root of all errors whose message is a sentence meant for the user."""


class FileAccessError(FisheyeError):
    """A file that cannot be read or written, whatever it holds.

    Attributes
    ----------
    path : str or Path
        Of the file.
    action : str
        What was tried: `read` or `written`.
    reason : str
        Why it failed.
    """

    def __init__(self, path: str | Path, action: str, reason: object):
        super().__init__(f'{path} cannot be {action}: {reason}')
        self.path, self.action, self.reason = path, action, str(reason)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.path, self.action, self.reason)


class FileContentError(FisheyeError):
    """A file that was read, but does not hold what was expected.

    Attributes
    ----------
    reason : str
        What does not fit, with its line where there is one.
    path : str or Path or None
        Of the file; None where only its text is known.
    """

    def __init__(self, reason: object, path: str | Path | None = None):
        super().__init__(f'{path}: {reason}' if path else str(reason))
        self.reason, self.path = str(reason), path

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.reason, self.path)


class CameraFileError(FileContentError):
    """A calibration file that describes no possible camera."""


class OverlapFileError(FileContentError):
    """An overlap file that lacks something, or was measured on another rig."""


class CalibrationError(FisheyeError):
    """Numbers that describe no possible lens, or a lens that cannot be fitted."""


class GeometryError(FisheyeError):
    """A surface that cannot exist or cannot hold what was asked of it."""


class SourceError(FisheyeError):
    """A source of pictures cannot be opened or stopped giving pictures."""


class ImageFormatError(FisheyeError):
    """A picture whose size, encoding or memory layout is not what was expected."""


class VideoError(FisheyeError):
    """Pictures cannot become video here, or not the other way round."""


class OverlapError(FisheyeError):
    """The overlap of two views cannot be measured from what was given."""


class SettingError(FisheyeError):
    """A parameter outside its type, range or choices."""


class BugError(FisheyeError):
    """What no code expected, in a part that the rest can do without."""
