"""Settings of a camera: the only place with their defaults."""

from dataclasses import dataclass, replace
from math import isnan, nan

from fisheye_core.settings import setting
from fisheye_core.video_settings import VideoSettings
from fisheye_geometry.lens import MAX_PICTURE_SIDE_PX


@dataclass(frozen=True)
class FrameSettings:
    """What the cameras of a rig have in common."""

    frame_rate_hz: float = setting(
        30.0, 'Pictures a second that are asked of the source.', minimum=0.1, maximum=1000.0
    )
    width: int = setting(
        0,
        'Width asked of a device or of the synthetic camera, px; 0: its own.',
        minimum=0,
        maximum=MAX_PICTURE_SIDE_PX,
    )
    height: int = setting(
        0,
        'Height asked of a device or of the synthetic camera, px; 0: its own.',
        minimum=0,
        maximum=MAX_PICTURE_SIDE_PX,
    )
    pixel_format: str = setting('MJPG', 'Four letters (FOURCC) asked of a device; empty: its own.')
    loop: bool = setting(True, 'Start a video or a folder of pictures again at its end.')
    encoding: str = setting(
        'bgr8', 'Encoding of the published pictures.', choices=('bgr8', 'mono8', 'rgb8')
    )
    reconnect_max_s: float = setting(
        2.0,
        'Longest wait between two attempts to reopen a camera that was lost.',
        minimum=0.1,
        maximum=3600.0,
    )
    connect_timeout_s: float = setting(
        10.0,
        'How long a network camera may take to answer.',
        minimum=0.5,
        maximum=120.0,
    )
    silence_timeout_s: float = setting(
        2.0,
        'A network camera that sends nothing for so long, or for three periods, is opened anew.',
        minimum=0.2,
        maximum=120.0,
    )
    first_picture_timeout_s: float = setting(
        30.0,
        'How long a network camera may send before its first keyframe comes.',
        minimum=1.0,
        maximum=600.0,
    )
    synthetic_fov_deg: float = setting(
        170.0,
        'Field of view of the synthetic camera across its picture.',
        minimum=30.0,
        maximum=240.0,
    )


@dataclass(frozen=True)
class CameraSettings:
    """What each camera of a rig has for itself."""

    source: str = setting(
        'synthetic',
        'synthetic, a device (0, /dev/video0), a picture, a folder or glob of pictures, a video, '
        'or an http, rtsp or udp URL; for panorama_node also topic: another node reads it.',
    )
    rtsp_transport: str = setting(
        'tcp',
        'How RTSP pictures come: tcp loses nothing, udp delays nothing.',
        choices=('tcp', 'udp'),
    )
    stamp_from: str = setting(
        'arrival',
        "Stamps of a network camera: arrival, or camera, the camera's own clock as its RTCP "
        'sender reports tell it; for cameras that are set by NTP.',
        choices=('arrival', 'camera'),
    )
    delay_ms: float = setting(
        0.0,
        'What a device or network camera needs from taking a picture to its arrival; taken off '
        'the stamps.',
        minimum=0.0,
        maximum=10000.0,
    )
    region: str = setting(
        '',
        "Part of the source's frames that this camera is: left, right, top or bottom half, or "
        'x,y,w,h in px; empty: the whole frame. Its calibration is of the region.',
    )
    camera_info_url: str = setting(
        '',
        'Calibration file: a path, file:// or package://; ${ROS_HOME} and ${NAME} (of the camera) '
        'are filled in; empty: none (synthetic: its own).',
    )
    camera_name: str = setting('', 'Name of the camera; empty: the last part of the namespace.')
    frame_id: str = setting('', 'Frame of the pictures; empty: the name and _optical_frame.')
    synthetic_yaw_deg: float = setting(
        nan,
        'Where the synthetic camera looks, positive to the right; NaN: -70 for a camera called '
        'left, 70 for right, 0 for any other.',
        minimum=-180.0,
        maximum=180.0,
        nan=True,
    )
    synthetic_pitch_deg: float = setting(
        0.0, 'How far the synthetic camera looks up.', minimum=-90.0, maximum=90.0
    )
    synthetic_roll_deg: float = setting(
        0.0,
        'How far the synthetic camera is turned about its axis, clockwise as it sees it; 180: it '
        'hangs upside down.',
        minimum=-180.0,
        maximum=180.0,
    )
    synthetic_gain: float = setting(
        1.0, 'Exposure of the synthetic camera.', minimum=0.05, maximum=20.0
    )

    def named(self, name: str) -> 'CameraSettings':
        """Return these settings with all that follows from the camera's name filled in.

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
class CaptureSettings(CameraSettings, FrameSettings, VideoSettings):
    """Settings of the capture node."""

    jpeg_quality: int = setting(
        80, 'Quality of the compressed pictures.', minimum=1, maximum=100, live=True
    )
