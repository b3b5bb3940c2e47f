"""Parameters of a camera: what it is, and in what form its pictures are wanted."""

from dataclasses import dataclass, replace
from math import isnan, nan

from fisheye_geometry.settings import setting


@dataclass(frozen=True)
class FrameSettings:
    """What the cameras of a rig have in common."""

    frame_rate_hz: float = setting(
        30.0, 'frames a second that are asked of the source', minimum=0.1, maximum=1000
    )
    width: int = setting(
        0, 'width of the pictures, px; 0: what the source gives', minimum=0, maximum=16384
    )
    height: int = setting(
        0, 'height of the pictures, px; 0: what the source gives', minimum=0, maximum=16384
    )
    pixel_format: str = setting('MJPG', 'FOURCC asked of a device; empty: its own default')
    loop: bool = setting(True, 'start a video or a folder of pictures again at its end')
    encoding: str = setting(
        'bgr8', 'encoding of the published pictures', choices=('bgr8', 'mono8', 'rgb8')
    )
    reconnect_max_s: float = setting(
        5.0, 'longest wait between two attempts to reopen a lost source', minimum=0.1, maximum=3600
    )
    synthetic_fov_deg: float = setting(
        170.0, 'field of view of the synthetic camera across the picture', minimum=30, maximum=240
    )


@dataclass(frozen=True)
class CameraSettings:
    """What each camera of a rig has for itself."""

    source: str = setting(
        'synthetic',
        "'synthetic', a device (0, /dev/video0), a picture, a folder or glob of pictures, a video "
        'file, or an http, rtsp or udp URL',
    )
    camera_info_url: str = setting(
        '', 'calibration file: a path, file:// or package://; empty: none (synthetic: its own)'
    )
    camera_name: str = setting('', 'name of the camera; empty: the last part of the namespace')
    frame_id: str = setting('', 'frame of the pictures; empty: CAMERA_NAME_optical_frame')
    synthetic_yaw_deg: float = setting(
        nan,
        'where the synthetic camera looks, positive to the right; NaN: -70 for a camera called '
        'left, 70 for right, else 0',
        minimum=-180,
        maximum=180,
        nan=True,
    )
    synthetic_gain: float = setting(
        1.0, 'exposure of the synthetic camera', minimum=0.05, maximum=20
    )

    def named(self, name: str) -> 'CameraSettings':
        """Give these settings with all that follows from the camera's name filled in.

        Parameters
        ----------
        name
            What the camera is called where `camera_name` is empty.
        """
        name = self.camera_name or name
        yaw_deg = self.synthetic_yaw_deg
        return replace(
            self,
            camera_name=name,
            frame_id=self.frame_id or f'{name}_optical_frame',
            synthetic_yaw_deg=_USUAL_YAW_DEG.get(name, 0.0) if isnan(yaw_deg) else yaw_deg,
        )


_USUAL_YAW_DEG = {'left': -70.0, 'right': 70.0}
"""Axes of the published rig, 140 degrees apart."""


@dataclass(frozen=True)
class CaptureSettings(CameraSettings, FrameSettings):
    """Parameters of capture_node."""
