"""Decoding a stream without delay, and without showing what arrived damaged."""

import os
import re
import time
from collections.abc import Iterator

import av
from av.video.codeccontext import VideoCodecContext

from fisheye_core import ffmpeg_log

_LOW_DELAY = 1 << 19
"""AV_CODEC_FLAG_LOW_DELAY, which has another name in each PyAV."""
_MAX_THREADS = 4
_DAMAGE = re.compile(
    'conceal|error while decoding|frame num gap|decode_slice_header error|corrupt|no frame|'
    'missing reference|could not find ref|invalid data|overread|out of range|bytestream|'
    'error at mb|cabac|reference picture missing',
    re.IGNORECASE,
)
"""What FFmpeg says where a picture is damaged; other complaints are about the camera's coding."""
_RECOVERY_S = 10.0
"""Without further damage; a stream that is refreshed without keyframes is whole after that."""


class PictureDecoder:
    """Pictures of one stream, each as soon as its last bit is there.

    Attributes
    ----------
    damaged : int
        Pictures that were not given out since the first one: they, or what they are drawn upon,
        came with errors.
    has_begun : bool
        Whether a whole picture came.
    waits : bool
        Whether what comes is withheld up to the next keyframe.
    """

    def __init__(self, context: VideoCodecContext):
        # Threads that share a picture cost no time; those that take one each delay it by as many.
        context.thread_type = 'SLICE'
        context.thread_count = min(_MAX_THREADS, os.cpu_count() or 1)
        context.flags = int(context.flags) | _LOW_DELAY
        self._context = context
        self.damaged, self.has_begun = 0, False
        self.waits, self._damaged_s = True, time.monotonic()

    def decode(
        self, packet: 'av.Packet', *, follows_loss: bool = False
    ) -> Iterator['av.VideoFrame']:
        """Yield the whole pictures that are done with a packet, usually one.

        Parameters
        ----------
        packet
            Of the stream.
        follows_loss
            Whether others before it are missing, which a decoder does not always notice.
        """
        with ffmpeg_log.captured() as said:
            try:
                frames = self._context.decode(packet)
                is_damaged = follows_loss
            except av.error.FFmpegError:
                frames, is_damaged = [], True
        is_damaged = is_damaged or any(
            level <= ffmpeg_log.ERROR and _DAMAGE.search(line) for level, _, line in said
        )
        if is_damaged:
            self.expect_keyframe()
            self.damaged += self.has_begun and not frames
        for frame in frames:
            if frame.is_corrupt or is_damaged:
                self.expect_keyframe()
            elif frame.key_frame or time.monotonic() > self._damaged_s + _RECOVERY_S:
                self.waits = False
            if not self.waits:
                self.has_begun = True
                yield frame
            else:
                self.damaged += self.has_begun

    def expect_keyframe(self) -> None:
        """Withhold frames until the next keyframe: those between would be drawn upon a gap."""
        self.waits, self._damaged_s = True, time.monotonic()
