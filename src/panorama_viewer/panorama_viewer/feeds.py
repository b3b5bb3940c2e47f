"""What a browser is sent of each panorama: the JPEG as it came, or H.264 of its own."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property

import numpy as np

from fisheye_core.coded_picture import decoded
from fisheye_core.errors import ImageFormatError
from fisheye_core.video import video_encoder
from fisheye_core.video_settings import EncoderSettings, VideoSettings
from panorama_viewer.pace import NOMINAL_HZ, PagePace
from panorama_viewer.projection import Quaternion

DELTA, KEYFRAME = b'\0', b'\1'
"""What a message with H.264 begins with; one with a JPEG begins as every JPEG does, with FF."""
_KEYFRAME_S = 60.0
"""Nothing is lost on the way to a page; one that cannot go on asks for a keyframe."""


class TimedJpeg:
    """A panorama as JPEG, when it came, s of the event loop's clock, and what levels it."""

    def __init__(self, jpeg: bytes, came_s: float, orientation: Quaternion | None = None):
        self.jpeg, self.came_s, self.orientation = jpeg, came_s, orientation

    @cached_property
    def pixels(self) -> np.ndarray:
        """(height, width, 3) uint8 BGR; an `ImageFormatError` if it is broken."""
        return decoded(np.frombuffer(self.jpeg, np.uint8))


class JpegFeed:
    """Sends a picture as it came when all before it were drawn."""

    name = 'JPEG'

    def __init__(self, under_way: int = 0):
        """Begin where so many pictures are on their way."""
        self._under_way = under_way

    def takes(self, picture: TimedJpeg, now_s: float, unconfirmed: int) -> bool:
        """Return whether the newest picture can be sent now."""
        return not self._under_way

    async def coded(self, picture: TimedJpeg) -> bytes:
        """Return what to send of a picture."""
        return picture.jpeg

    def sent(self, now_s: float, size: int) -> None:
        """Note that so many bytes were sent."""
        self._under_way += 1

    def drawn(self, now_s: float) -> None:
        """Note that the oldest picture on its way was drawn."""
        self._under_way -= 1

    def restart(self) -> None:
        """Do nothing: each picture stands alone."""


class VideoFeed:
    """Sends H.264 that is encoded for one page, at the rate and the bit rate that its link takes.

    What the page cannot take is not encoded: so each picture follows upon one that was sent.
    """

    name = 'H.264'

    def __init__(
        self, settings: Callable[[], EncoderSettings], worker: ThreadPoolExecutor, now_s: float
    ):
        """Prepare.

        Parameters
        ----------
        settings
            Returns the current ones.
        worker
            Of one thread, which encodes for every page.
        now_s
            The time, s.

        Raises
        ------
        VideoError
            If there is no encoder.
        """
        self._settings, self._worker = settings, worker
        self._encoder = video_encoder(
            VideoSettings(
                video_bitrate_kbps=settings().video_bitrate_kbps,
                video_encoder=settings().video_encoder,
                video_keyframe_s=_KEYFRAME_S,
            )
        )
        self._pace = PagePace(settings().video_bitrate_kbps, now_s)
        self._offered: TimedJpeg | None = None
        self._count = 0

    def takes(self, picture: TimedJpeg, now_s: float, unconfirmed: int) -> bool:
        """Return whether the newest picture can be sent now."""
        is_new, self._offered = picture is not self._offered, picture
        most_kbps = self._settings().video_bitrate_kbps
        return self._pace.takes(most_kbps, now_s, is_new=is_new, unconfirmed=unconfirmed)

    async def coded(self, picture: TimedJpeg) -> bytes:
        """Return what to send of a picture; nothing of one that is broken.

        Raises
        ------
        VideoError
            If no encoder works.
        """
        return await asyncio.get_running_loop().run_in_executor(
            self._worker, self._encode, picture
        )

    def sent(self, now_s: float, size: int) -> None:
        """Note that so many bytes were sent."""
        self._pace.sent(now_s, size)

    def drawn(self, now_s: float) -> None:
        """Note that the oldest picture on its way was drawn."""
        self._pace.drawn(now_s)

    def restart(self) -> None:
        """Begin with the next picture anew."""
        self._encoder.request_keyframe()

    def _encode(self, picture: TimedJpeg) -> bytes:
        self._encoder.bitrate_kbps = self._pace.nominal_kbps
        self._count += 1
        try:
            # The pace sees to the rate; each picture has the same share of bits.
            now_s = self._count / NOMINAL_HZ
            encoded = self._encoder.encode(picture.pixels, now_s=now_s)
            return (KEYFRAME if encoded.is_keyframe else DELTA) + encoded.data
        except ImageFormatError:
            return b''
