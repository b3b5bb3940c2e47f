"""A network camera read without pause: of its pictures only the newest waits to be fetched."""

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from threading import Condition, Thread
from typing import Any

import av

from fisheye_capture.network_address import StreamError, loss, open_camera
from fisheye_capture.network_request import StreamRequest
from fisheye_capture.packets import Arrival, packet_reader
from fisheye_core.picture_decoder import PictureDecoder

_BACKLOG_NS = 300_000_000
"""So far behind, the decoder goes on at the newest keyframe."""
_KEYFRAME_S = 4.0
"""Without a picture for so long, what is missing is said."""
_MAX_STAMPS = 100
"""Of pictures that a decoder may hold back."""


@dataclass(frozen=True)
class StreamPicture:
    """A picture as it came: a JPEG, or decoded but still in the stream's own pixel format."""

    stamp_ns: int
    jpeg: bytes | None = None
    frame: Any = None  # an av.VideoFrame where it is no JPEG


class StreamCamera:
    """A network camera.

    Attributes
    ----------
    skipped : int
        Pictures that were not decoded because this machine was too slow.
    """

    def __init__(self, request: StreamRequest):
        """Open it and begin to read.

        Raises
        ------
        StreamError
            If it cannot be opened.
        """
        self._request = request
        opened = open_camera(request)
        stream = opened.container.streams.video[0]
        self._codec = stream.codec_context.name
        self._reader = packet_reader(request, opened)
        self._decoder = PictureDecoder(stream.codec_context)
        self._changed = Condition()
        self._arrivals: deque[Arrival] = deque()
        self._stamps_ns: dict[int | None, int] = {}
        self._newest: StreamPicture | None = None
        self._end = self._waiting = ''
        self.skipped = 0
        self._heard_s = self._seen_s = time.monotonic()
        for work in (self._drain, self._decode):
            Thread(target=self._run, args=(work,), daemon=True).start()

    @property
    def damaged(self) -> int:
        """Pictures that came and were not whole."""
        return self._decoder.damaged

    @property
    def note(self) -> str:
        """What a user should know of it now; '' for nothing."""
        return self._waiting or self._reader.note

    def picture(self, timeout_s: float) -> StreamPicture | None:
        """Wait for a picture that was not given yet; None if there is none in time.

        Raises
        ------
        StreamError
            When the camera is lost.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._newest or self._end, timeout_s)
            if self._end:  # What waits is not live any more.
                raise StreamError(self._end)
            picture, self._newest = self._newest, None
        if picture is None:
            self._check_silence()
        return picture

    def _check_silence(self):
        request, now_s = self._request, time.monotonic()
        silence_s = request.silence_s
        if now_s - self._heard_s > silence_s:
            raise StreamError(
                f'{request.shown} stopped sending pictures: nothing came for {silence_s:g} s'
            )
        waited_s = now_s - self._seen_s
        if waited_s < _KEYFRAME_S or waited_s < silence_s:
            return
        self._waiting = (
            f'{request.shown} sends {self._codec}, but no whole keyframe for {waited_s:.0f} s; '
            'set its GOP (interval of I-frames) to 1 s'
        )
        if waited_s > request.first_picture_timeout_s:
            raise StreamError(self._waiting)

    def _run(self, work):
        try:
            work()
            reason = f'{self._request.shown} stopped sending pictures: it ended the stream'
        except StreamError as error:
            reason = str(error)
        except (av.error.FFmpegError, OSError) as error:
            reason = loss(self._request, error)
        with self._changed:
            self._end = self._end or reason
            self._changed.notify_all()

    def _drain(self):
        """Drain the stream as it comes, whatever becomes of it."""
        for arrival in self._reader.read():
            with self._changed:
                self._heard_s = time.monotonic()
                self._arrivals.append(arrival)
                self._changed.notify_all()

    def _decode(self):
        while not self._end:
            with self._changed:
                self._changed.wait_for(lambda: self._arrivals or self._end)
                if self._end:
                    return
                self._catch_up()
                arrival = self._arrivals.popleft()
            for picture in self._pictures(arrival):
                if arrival.is_live:
                    with self._changed:
                        self._newest, self._waiting = picture, ''
                        self._seen_s = time.monotonic()
                        self._changed.notify_all()

    def _catch_up(self):
        """Where decoding is too slow, go on at the newest picture that needs no other."""
        arrivals = self._arrivals
        if not arrivals[-1].is_live or (
            arrivals[-1].stamp_ns - arrivals[0].stamp_ns < _BACKLOG_NS and self._codec != 'mjpeg'
        ):
            return
        keys = [
            at
            for at, arrival in enumerate(arrivals)
            if arrival.packet.is_keyframe or self._codec == 'mjpeg'
        ]
        for _ in range(keys[-1] if keys else 0):
            self.skipped += arrivals.popleft().is_live

    def _pictures(self, arrival: Arrival) -> Iterator[StreamPicture]:
        packet = arrival.packet
        if self._codec == 'mjpeg':
            yield StreamPicture(arrival.stamp_ns, jpeg=bytes(packet))
            return
        self._stamps_ns[packet.pts] = arrival.stamp_ns
        for frame in self._decoder.decode(packet, follows_loss=arrival.follows_loss):
            yield StreamPicture(self._stamps_ns.get(frame.pts, arrival.stamp_ns), frame=frame)
        while len(self._stamps_ns) > _MAX_STAMPS:
            del self._stamps_ns[next(iter(self._stamps_ns))]
