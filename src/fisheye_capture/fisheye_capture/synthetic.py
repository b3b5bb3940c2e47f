"""The synthetic camera: a fisheye lens in the synthetic world."""

import numpy as np

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.pace import PacedSource
from fisheye_capture.scene import Scene
from fisheye_core.encodings import from_opencv
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera_file import Camera
from fisheye_geometry.lens import FisheyeLens

_SIZE_PX = 640, 480
_DISTORTION = (-0.02, 0.004, -0.001, 0.0001)


class SyntheticSource(PacedSource):
    """Frames of the scene; its camera is known exactly."""

    def __init__(self, settings: CaptureSettings):
        super().__init__(settings.frame_rate_hz)
        width, height = settings.width or _SIZE_PX[0], settings.height or _SIZE_PX[1]
        lens = synthetic_lens(width, height, np.radians(settings.synthetic_fov_deg))
        self.camera = Camera(settings.camera_name, lens)
        angles_deg = (
            settings.synthetic_yaw_deg,
            settings.synthetic_pitch_deg,
            settings.synthetic_roll_deg,
        )
        attitude = Attitude(*np.radians(angles_deg))
        self._view = Scene().view(lens, attitude, settings.synthetic_gain)
        self._encoding = settings.encoding

    def _picture(self, stamp_ns):
        return from_opencv(self._view.frame(stamp_ns), self._encoding)


def synthetic_lens(width: int, height: int, fov_rad: float) -> FisheyeLens:
    """Return the lens whose field of view spans the width of the picture."""
    unit = FisheyeLens(width, height, 1.0, 1.0, 0.0, 0.0, _DISTORTION)
    (edge, _), _ = unit.project(np.array([np.sin(fov_rad / 2), 0.0, np.cos(fov_rad / 2)]))
    focal_px = width / 2 / edge
    center_px = (width - 1) / 2, (height - 1) / 2
    return FisheyeLens(width, height, focal_px, focal_px, *center_px, _DISTORTION)
