"""Settings of video: the only place with their defaults."""

from dataclasses import dataclass

from fisheye_core.settings import setting

ENCODERS = ('auto', 'h264_nvenc', 'h264_v4l2m2m', 'h264_vaapi', 'libx264')
"""Names of FFmpeg; auto takes the first that works here."""


@dataclass(frozen=True)
class EncoderSettings:
    """How pictures are encoded."""

    video_bitrate_kbps: int = setting(
        2000,
        'Most kbit that the video takes in a second; easy pictures take less.',
        minimum=100,
        maximum=100000,
        live=True,
    )
    video_encoder: str = setting(
        'auto',
        'Encoder: one of the hardware, or libx264; auto is the first that works here.',
        choices=ENCODERS,
    )


@dataclass(frozen=True)
class VideoSettings(EncoderSettings):
    """How pictures become video, for whoever subscribes to it."""

    video_codec: str = setting('h264', 'Codec of the video.', choices=('h264',))
    video_keyframe_s: float = setting(
        1.0,
        'Longest time between two keyframes, at which a player can begin; 0: only when somebody '
        'comes or asks, and in between each part of the picture is renewed within a second, which '
        'keeps the largest packets small.',
        minimum=0.0,
        maximum=60.0,
        live=True,
    )
