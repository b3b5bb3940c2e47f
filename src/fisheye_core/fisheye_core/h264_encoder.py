"""Pictures to H.264 without delay: one picture in, one packet out, at a capped bit rate."""

import os
import time
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

import av
import numpy as np
from av.codec.codec import UnknownCodecError
from av.error import FFmpegError
from av.video.codeccontext import VideoCodecContext
from av.video.frame import PictureType

from fisheye_core import ffmpeg_log
from fisheye_core.errors import VideoError
from fisheye_core.nal_units import is_keyframe, parameter_sets
from fisheye_core.picture_rate import PictureRate
from fisheye_core.planar_picture import to_planes
from fisheye_core.video_settings import ENCODERS

_USUAL_HZ = 30.0
_PIXELS_OF_A_THREAD = 1_000_000
_RATE, _MOST = 0.85, 1.05
"""Shares of the cap: in no second more than the latter, as a full buffer adds to the rate."""
_LATER = 1.2
"""Keyframes are asked for by time; hardware that does not listen makes its own a little later."""
_COMMON = {'colorspace': 'smpte170m', 'color_range': 'tv'}
_OPTIONS = {
    'libx264': {'preset': 'superfast', 'tune': 'zerolatency', 'crf': '22', 'forced-idr': '1'},
    'h264_nvenc': {
        'preset': 'p2',
        'tune': 'ull',
        'delay': '0',
        'zerolatency': '1',
        'rc': 'cbr',
        'forced-idr': '1',
    },
    'h264_v4l2m2m': {},
    'h264_vaapi': {'async_depth': '1', 'rc_mode': 'CBR'},
}
"""Without delay and B-frames; those of the bit rate follow from the settings."""


class EncodedPicture(NamedTuple):
    """One picture as H.264 (annex B); a keyframe has its parameter sets with it."""

    data: bytes
    is_keyframe: bool


class H264Encoder:
    """Encodes the pictures of one stream, of any sizes; each is one packet at once.

    One thread encodes; the attributes and `request_keyframe` are for any thread. A change of size,
    bit rate or rate of pictures begins with a keyframe.

    Attributes
    ----------
    bitrate_kbps : int
        What is sent in any second at most, within 5 %; changes at any time.
    keyframe_s : float
        Longest time between two keyframes; 0: each part of the picture is renewed within a second
        in place of them.
    name : str
        FFmpeg's encoder in use; '' before the first picture.
    note : str
        Why it is not the one that was asked for; '' for nothing.
    """

    def __init__(self, *, bitrate_kbps: int, keyframe_s: float, encoder: str):
        """Set up; `encoder` is one of `ENCODERS`."""
        self.bitrate_kbps, self.keyframe_s = bitrate_kbps, keyframe_s
        self.name = self.note = ''
        names = ENCODERS[1:] if encoder == 'auto' else dict.fromkeys((encoder, ENCODERS[-1]))
        self._candidates, self._asked = list(names), encoder
        self._context: VideoCodecContext | None = None
        self._opened: tuple[int, int, int, float] = 0, 0, 0, 0.0
        self._rate, self._count = PictureRate(_USUAL_HZ), 0
        self._is_keyframe_wanted, self._keyframe_s = False, 0.0
        self._parameter_sets = b''

    def request_keyframe(self) -> None:
        """Make the next picture a keyframe."""
        self._is_keyframe_wanted = True

    def encode(
        self, image: np.ndarray, encoding: str = 'bgr8', now_s: float | None = None
    ) -> EncodedPicture:
        """Encode a picture.

        Parameters
        ----------
        image
            (height, width[, 3]) uint8. Odd sides get their last column or row twice; what exceeds
            level 5.1 is halved until it fits.
        encoding
            One of `fisheye_core.encodings.CHANNELS`.
        now_s
            Time on a steady clock, from which the rate follows; None: now.

        Raises
        ------
        VideoError
            If no encoder works.
        ImageFormatError
            If the picture is empty.
        """
        planes = to_planes(image, encoding)
        height, width = planes.shape[0] * 2 // 3, planes.shape[1]
        now_s = time.monotonic() if now_s is None else now_s
        has_new_rate = self._rate.changed(now_s)
        if self.keyframe_s:
            # The picture that is nearest to the time: no two are exactly a period apart.
            due_s = self._keyframe_s + self.keyframe_s - 0.5 / self._rate.hz
            if now_s > due_s:
                self.request_keyframe()
        wanted = width, height, self.bitrate_kbps, self.keyframe_s
        if self._context is None or has_new_rate or self._opened != wanted:
            self._opened = wanted
            picture = self._begin(planes)
        else:
            picture = self._next(planes, self._context)
        if picture.is_keyframe:
            self._keyframe_s = now_s
        return picture

    def _next(self, planes: np.ndarray, context: VideoCodecContext) -> EncodedPicture:
        with suppress(FFmpegError):
            if picture := self._encoded(planes, context):
                return picture
        # Hardware may fail at any time; without it the stream goes on.
        fault = f'{self.name} stopped working'
        self._candidates = self._candidates[1:] or list(ENCODERS[-1:])
        picture = self._begin(planes)
        self.note = f'{fault}; {self.name} encodes in its place'
        return picture

    def _begin(self, planes: np.ndarray) -> EncodedPicture:
        """Open the first encoder that makes one packet of the picture at once."""
        faults = []
        for name in self._candidates:
            with ffmpeg_log.captured() as said:
                try:
                    self._context, self._count = self._open(name), 0
                    picture = self._encoded(planes, self._context)
                    if picture and picture.is_keyframe:
                        break
                    reason = 'it delays pictures'
                except UnknownCodecError:
                    reason = 'FFmpeg was built without it'
                except FFmpegError as error:
                    reason = said[0][2].strip().rstrip('.') if said else error.strerror
            faults.append(f'{name} cannot be used: {reason}')
        else:
            self._context = None
            raise VideoError(f'no encoder for H.264 works here ({"; ".join(faults)})')
        self._candidates = self._candidates[self._candidates.index(name) :]
        self.name = name
        if faults and self._asked != 'auto':
            self.note = f'{faults[0]}; {name} encodes in its place'
        return picture

    def _open(self, name: str) -> VideoCodecContext:
        width, height, bitrate_kbps, keyframe_s = self._opened
        context = av.CodecContext.create(name, 'w')
        context.width, context.height, context.pix_fmt = width, height, 'yuv420p'
        hz = Fraction(self._rate.hz).limit_denominator(1000)
        context.framerate, context.time_base = hz, 1 / hz
        context.thread_type = 'SLICE'
        threads = width * height // _PIXELS_OF_A_THREAD + 1
        context.thread_count = min(threads, os.cpu_count() or 1)
        interval = max(1, round(hz * (_LATER * keyframe_s or 1)))
        # The buffer holds one picture at least, which of a slow stream is much of a second.
        share = min(_RATE, _MOST * self._rate.hz / (self._rate.hz + 1))
        rate, buffer = (round(s * 1000 * bitrate_kbps) for s in (share, _MOST - share))
        options = {**_COMMON, **_OPTIONS[name], 'g': f'{interval}', 'bf': '0'}
        options |= {'b': f'{rate}', 'maxrate': f'{rate}', 'bufsize': f'{buffer}'}
        if name == 'libx264':
            options['x264-params'] = f'scenecut=0:intra-refresh={int(keyframe_s == 0)}'
        context.options = options
        context.open()
        return context

    def _encoded(self, planes: np.ndarray, context: VideoCodecContext) -> EncodedPicture | None:
        """Encode planes; None if not exactly one packet comes out."""
        frame = self._frame(planes)
        frame.pts, self._count = self._count, self._count + 1
        packets = context.encode(frame)
        if len(packets) != 1:
            return None
        data = bytes(packets[0])
        if not is_keyframe(data):
            return EncodedPicture(data, False)
        sets = parameter_sets(data)
        if not sets:  # Some hardware sends them but once.
            data = self._parameter_sets + data
        self._parameter_sets = sets or self._parameter_sets
        return EncodedPicture(data, True)

    def _frame(self, planes: np.ndarray) -> av.VideoFrame:
        frame = av.VideoFrame.from_ndarray(planes, format='yuv420p')
        if self._is_keyframe_wanted or not self._count:
            self._is_keyframe_wanted = False
            frame.pict_type = PictureType.I
        return frame
