"""The messages that carry video: one always, others where their packages are installed."""

import importlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from std_msgs.msg import Header

from fisheye_bridge.stamps import ns_of
from fisheye_core.video_settings import VideoSettings

if TYPE_CHECKING:
    from fisheye_core.h264_encoder import EncodedPicture


@dataclass(frozen=True, eq=False)
class VideoPicture:
    """What is to be encoded: (height, width[, 3]) uint8 in an encoding."""

    image: np.ndarray
    encoding: str
    header: Header
    settings: VideoSettings


@dataclass(frozen=True)
class MessageType:
    """A type of message: where it is defined, on which topic, and its fields beside the data."""

    module: str
    name: str
    topic: str
    fields: Callable[['EncodedPicture', VideoPicture], dict[str, Any]]


_KINDS = (
    MessageType(
        'sensor_msgs.msg',
        'CompressedImage',
        '{video}/compressed',
        lambda encoded, picture: {
            'header': picture.header,
            'format': picture.settings.video_codec,
        },
    ),
    MessageType(
        'foxglove_msgs.msg',
        'CompressedVideo',
        '{video}',
        lambda encoded, picture: {
            'timestamp': picture.header.stamp,
            'frame_id': picture.header.frame_id,
            'format': picture.settings.video_codec,
        },
    ),
    MessageType(
        'ffmpeg_image_transport_msgs.msg',
        'FFMPEGPacket',
        '{image}/ffmpeg',
        lambda encoded, picture: {
            'header': picture.header,
            'width': picture.image.shape[1],
            'height': picture.image.shape[0],
            'encoding': f'{picture.settings.video_codec};yuv420p;bgr8;{picture.encoding}',
            'pts': ns_of(picture.header.stamp),
            'flags': int(encoded.is_keyframe),  # AV_PKT_FLAG_KEY
        },
    ),
)
"""Only the first is always there; the packages of the others are not among our dependencies."""


def message_types() -> Iterator[tuple[MessageType, type]]:
    """Yield the types that are installed, each with its class."""
    for kind in _KINDS:
        try:
            yield kind, getattr(importlib.import_module(kind.module), kind.name)
        except ImportError:
            continue
