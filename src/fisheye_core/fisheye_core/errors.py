"""Every error this project raises on purpose: one root, a family for each kind of cause."""


class FisheyeError(Exception):
    """Root of all errors whose message is a sentence meant for the user."""


class CameraFileError(FisheyeError):
    """A calibration or overlap file cannot be read, written or believed."""


class CalibrationError(FisheyeError):
    """Numbers that describe no possible lens, or a lens that cannot be fitted."""


class GeometryError(FisheyeError):
    """A surface that cannot exist or cannot hold what was asked of it."""


class SourceError(FisheyeError):
    """A source of pictures cannot be opened or stopped giving pictures."""


class ImageFormatError(FisheyeError):
    """A picture whose size, encoding or memory layout is not what was expected."""


class OverlapError(FisheyeError):
    """The overlap of two views cannot be measured from what was given."""


class SettingError(FisheyeError):
    """A parameter outside its type, range or choices."""


class BugError(FisheyeError):
    """What no code expected, in a part that the rest can do without."""
