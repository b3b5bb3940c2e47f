"""What comes from a network camera, packet by packet, each with the time at which it came."""

import time
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import av

from fisheye_capture.arrival import ArrivalClock
from fisheye_capture.network_address import Opened, open_camera, tells_of_loss
from fisheye_capture.network_request import MAX_DIFFERENCE_NS, StreamRequest
from fisheye_core import ffmpeg_log

_BURST_S = 0.003
"""What comes sooner than that was held up, or read while the stream was looked at."""
_LONGEST_BURST_S = 2.0
_LATE = {('rtsp', False): 1, ('mpegts', True): 1, ('mpegts', False): 2}
"""Pictures that FFmpeg waits for until it gives one, by container and whether that is UDP."""
_NS_PER_S = 1_000_000_000


@dataclass(frozen=True)
class Arrival:
    """A packet and when it came, ns since the epoch.

    Attributes
    ----------
    is_live
        Whether it was read as it came.
    follows_loss
        Whether something before or in it got lost.
    """

    packet: 'av.Packet'
    stamp_ns: int
    is_live: bool = True
    follows_loss: bool = False


class PacketReader:
    """Reads a camera that sends of itself.

    Attributes
    ----------
    note : str
        What a user should know of its clock; '' for nothing.
    """

    def __init__(self, request: StreamRequest, opened: Opened):
        container = opened.container
        self._request, self._container = request, container
        self._is_lossy = opened.is_lossy
        self._stream = container.streams.video[0]
        self._format = container.format.name
        is_coded = self._stream.codec_context.name != 'mjpeg'
        late = is_coded * _LATE.get((self._format, request.scheme == 'udp'), 0)
        self._arrivals_ns: deque[int] = deque(maxlen=1 + late)
        self._clock, self.note = ArrivalClock(), ''

    def read(self) -> Iterator[Arrival]:
        """Yield what comes until it ends; an FFmpeg error if it is cut off."""
        begin_s = time.monotonic()
        is_live = False
        packets = self._container.demux(self._stream)
        while True:
            asked_s = time.monotonic()
            with ffmpeg_log.captured() as said:
                packet = next(packets, None)
            if packet is None or not packet.size:
                return
            arrival_ns, now_s = time.time_ns(), time.monotonic()
            is_live = is_live or now_s - asked_s > _BURST_S or now_s - begin_s > _LONGEST_BURST_S
            is_lossy = packet.is_corrupt or tells_of_loss(said) or self._is_lossy
            self._is_lossy &= not is_live  # What was lost while opening lies before this.
            yield Arrival(packet, self._stamp_ns(packet, arrival_ns), is_live, is_lossy)

    def _stamp_ns(self, packet, arrival_ns):
        if self._request.stamp_from == 'camera' and (taken_ns := _camera_ns(packet)):
            if abs(arrival_ns - taken_ns) < MAX_DIFFERENCE_NS:
                return taken_ns
            self.note = (
                f'the clock of {self._request.shown} is {(taken_ns - arrival_ns) / 1e9:+.1f} s '
                'off: stamps are of arrival; set its NTP server'
            )
        # What FFmpeg gave then, it gave because this one began to come.
        self._arrivals_ns.append(arrival_ns)
        # Of other containers FFmpeg invents the times.
        media_ns = _media_ns(packet) if self._format in ('rtsp', 'mpegts') else None
        return self._clock.stamp_ns(media_ns, self._arrivals_ns[0])


class PlaylistReader(PacketReader):
    """Reads a playlist (HLS), whose pictures come by the second, at the rate of their times."""

    def read(self) -> Iterator[Arrival]:
        """Yield the packets, each when it is due."""
        start_ns = None
        for arrival in super().read():
            packet = arrival.packet
            media_ns, now_ns = _media_ns(packet) or 0, time.time_ns()
            if start_ns is None or abs(start_ns + media_ns - now_ns) > MAX_DIFFERENCE_NS:
                start_ns = now_ns - media_ns
            time.sleep(max(0, start_ns + media_ns - now_ns) / _NS_PER_S)
            yield Arrival(packet, time.time_ns())


class SnapshotReader:
    """Asks a camera that gives one picture a request for one after the other."""

    note = ''

    def __init__(self, request: StreamRequest, opened: Opened):
        self._request, self._first = request, opened.container

    def read(self) -> Iterator[Arrival]:
        """Yield the pictures, asked for on a grid of times."""
        period_s = 1 / self._request.frame_rate_hz
        self._first.close()
        due_s = time.monotonic()
        while True:
            due_s = max(due_s + period_s, time.monotonic())
            with open_camera(self._request).container as container:
                for packet in container.demux(container.streams.video[0]):
                    if packet.size:
                        yield Arrival(packet, time.time_ns())
            time.sleep(max(0.0, due_s - time.monotonic()))


def packet_reader(request: StreamRequest, opened: Opened) -> PacketReader | SnapshotReader:
    """Return what reads an opened camera of its kind."""
    name = opened.container.format.name
    if name.endswith('_pipe'):
        return SnapshotReader(request, opened)
    return (PlaylistReader if name == 'hls' else PacketReader)(request, opened)


def _camera_ns(packet):
    """Return when the camera took it by its own clock, from sender reports; None if unknown."""
    if not hasattr(packet, 'has_sidedata') or not packet.has_sidedata('prft'):
        return None
    return int.from_bytes(bytes(packet.get_sidedata('prft'))[:8], 'little') * 1000


def _media_ns(packet) -> int | None:
    """Return the time of a packet in its stream, ns; None if it has none."""
    ticks = packet.pts if packet.dts is None else packet.dts
    return None if ticks is None else int(ticks * packet.time_base * _NS_PER_S)
