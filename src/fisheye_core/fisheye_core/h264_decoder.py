"""H.264 to pictures without delay, and without showing what arrived damaged."""

import time
from math import inf, isfinite

import av
import numpy as np

from fisheye_core.encodings import from_opencv
from fisheye_core.nal_units import is_keyframe
from fisheye_core.picture_decoder import PictureDecoder
from fisheye_core.picture_numbers import PictureNumbers
from fisheye_core.planar_picture import MAX_MACROBLOCKS

_MAX_PIXELS = MAX_MACROBLOCKS * 256
"""A few bytes can claim to be more than fits into memory."""
_MANY_PERIODS = 10
"""After a longer pause so many pictures may be missing that their numbers are what they were."""
_USUAL_PERIOD_S, _LONGEST_PERIOD_S, _NEWEST = 1 / 30, 1.0, 0.1


class H264Decoder:
    """Decodes the pictures of one stream; what is drawn upon a gap is dropped.

    Attributes
    ----------
    damaged : int
        Pictures that were dropped since the first whole one.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._pictures, self._numbers = _fresh(), PictureNumbers()
        self._came_s, self._period_s = -inf, _USUAL_PERIOD_S

    @property
    def wants_keyframe(self) -> bool:
        """Whether nothing can be shown before the next keyframe."""
        return self._pictures.waits

    def decode(
        self, data: bytes, encoding: str = 'bgr8', now_s: float | None = None
    ) -> np.ndarray | None:
        """Decode a message; whatever it holds, this only ever returns.

        Parameters
        ----------
        data
            The bytes of one picture, annex B.
        encoding
            Of the result, one of `fisheye_core.encodings.CHANNELS`.
        now_s
            When it was taken or came; None: now.

        Returns
        -------
        ndarray or None
            (height, width[, 3]) uint8, the newest picture; None if there is none that is whole.
        """
        now_s = time.monotonic() if now_s is None else now_s
        if self._numbers.has_gap(data) or self._is_after_pause(now_s):
            self._pictures.expect_keyframe()
        has_begun = self._pictures.has_begun
        if self._pictures.waits:
            if not is_keyframe(data):
                self.damaged += has_begun
                return None
            # What came before a keyframe, whole or not, has no part in it.
            self._pictures = _fresh()
            self._pictures.has_begun = has_begun
        pictures = self._pictures
        before = pictures.damaged
        frames = list(pictures.decode(av.Packet(data)))
        self.damaged += pictures.damaged - before
        if not frames:
            pictures.expect_keyframe()
            return None
        grey = encoding == 'mono8'
        return from_opencv(frames[-1].to_ndarray(format='gray' if grey else 'bgr24'), encoding)

    def _is_after_pause(self, now_s: float) -> bool:
        passed_s, self._came_s = now_s - self._came_s, now_s
        is_after_pause = passed_s > _MANY_PERIODS * self._period_s
        if isfinite(passed_s):
            period_s = min(max(passed_s, 0.0), _LONGEST_PERIOD_S)
            self._period_s += _NEWEST * (period_s - self._period_s)
        return is_after_pause


def _fresh() -> PictureDecoder:
    context = av.CodecContext.create('h264', 'r')
    context.options = {'max_pixels': f'{_MAX_PIXELS}'}
    return PictureDecoder(context)
