"""Video of pictures: the door to encoder and decoder, which need PyAV, and that is optional."""

from typing import TYPE_CHECKING

from fisheye_core.errors import VideoError
from fisheye_core.video_settings import VideoSettings

if TYPE_CHECKING:
    from fisheye_core.h264_decoder import H264Decoder
    from fisheye_core.h264_encoder import H264Encoder


def video_encoder(settings: VideoSettings) -> 'H264Encoder':
    """Return an encoder; raise a `VideoError` if PyAV is missing."""
    _check_av()
    from fisheye_core.h264_encoder import H264Encoder

    return H264Encoder(
        bitrate_kbps=settings.video_bitrate_kbps,
        keyframe_s=settings.video_keyframe_s,
        encoder=settings.video_encoder,
    )


def video_decoder() -> 'H264Decoder':
    """Return a decoder; raise a `VideoError` if PyAV is missing."""
    _check_av()
    from fisheye_core.h264_decoder import H264Decoder

    return H264Decoder()


def _check_av() -> None:
    try:
        import av  # noqa: F401
    except ImportError as error:
        raise VideoError(
            f'video needs PyAV, which is missing here ({error}): sudo apt install python3-av, or '
            'pip install av'
        ) from error
