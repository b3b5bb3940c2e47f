"""Pairing: frames of several cameras that were taken at the same time.

Cameras run free: at any phase, drifting through all of them, with stamps that jitter. The frames
that wait form a queue for each camera, and the heads of all queues are the next group. The
earliest head gives way to its successor only where that makes the group clearly tighter, whether
the successor waits already or is only due. So no frame is refused for a doubtful gain, and a
frame that gave way is gone: the other cameras' frames are bound to what comes next.

Where the frames of one camera come later than those of another, as over a network, the other
ones wait for as long as that has been seen to take.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from math import inf
from statistics import median
from typing import Any, NamedTuple

from panorama_stitch.pipeline.frame_clock import FrameClock

LONGEST_WAIT_NS = 3_000_000_000
"""No frame waits longer for one that comes later; stamps farther apart are of other clocks."""
ROOM_BYTES = 300_000_000
"""For what waits of all cameras: at 30 Hz 2.7 s of one with 1280x960 px in colour."""
_ALWAYS = 8
"""Frames of each camera that may wait in any case."""
_LAGS = 300
"""Recent frames of all cameras of which it is remembered how late they came."""
_CLEARLY = 0.6
"""Of a group's spread; a gain that is smaller, or within the jitter, is not worth a frame."""
_SKEWS = 300
"""Recent pairs of which the skew is remembered."""


class Stamped(NamedTuple):
    """A frame and when it was taken."""

    stamp_ns: int
    frame: Any


class _Waiting(NamedTuple):
    """A frame in a queue, its stamp without the jitter, and its size in memory."""

    stamped: Stamped
    smooth_ns: float
    nbytes: int


@dataclass
class _Track:
    """What waits of one camera."""

    waiting: deque[_Waiting] = field(default_factory=deque)
    clock: FrameClock = field(default_factory=FrameClock)
    unpaired: int = 0

    def add(self, new: Stamped, nbytes: int) -> bool:
        """Let a frame wait; return whether the clock jumped back."""
        is_later = self.clock.last_ns is None or new.stamp_ns > self.clock.last_ns
        smooth_ns = self.clock.tick(new.stamp_ns)
        if not is_later:
            # The clock jumped back: what waits belongs to another time.
            self.clear()
        self.waiting.append(_Waiting(new, smooth_ns, nbytes))
        return not is_later

    def drop(self) -> None:
        self.unpaired += 1
        self.waiting.popleft()

    def clear(self) -> None:
        self.unpaired += len(self.waiting)
        self.waiting.clear()

    @property
    def head(self) -> _Waiting:
        return self.waiting[0]

    @property
    def nbytes(self) -> int:
        return sum(frame.nbytes for frame in self.waiting)

    def times_ns(self, near_ns: float) -> list[float]:
        """When the frames that wait were taken, and the one that is due nearest to a time."""
        due_ns = self.clock.due_ns(near_ns)
        waiting = [frame.smooth_ns for frame in self.waiting]
        return waiting if due_ns is None else [*waiting, due_ns]


class FramePairing:
    """Groups the frames of several cameras by their stamps, within bounded memory.

    Frames come in any order. A group is returned as soon as its last frame comes; frames that are
    older than a group that was returned are dropped and counted.

    Attributes
    ----------
    skews_ns : deque of int
        Largest difference of stamps within each of the recent groups.
    is_full : bool
        Whether a frame was dropped for want of room since the last group.
    """

    def __init__(self, cameras: Sequence[str], max_skew_ns: int):
        self._tracks = {camera: _Track() for camera in cameras}
        self.max_skew_ns = max_skew_ns
        self.skews_ns: deque[int] = deque(maxlen=_SKEWS)
        self.is_full = False
        self._passed_ns = -inf
        self._lags_ns: deque[tuple[str, int]] = deque(maxlen=_LAGS)

    @property
    def unpaired(self) -> dict[str, int]:
        """How many frames of each camera found no partner."""
        return {camera: track.unpaired for camera, track in self._tracks.items()}

    @property
    def spread_ns(self) -> int:
        """How far apart the newest stamps of the cameras lie; 0 before all have one."""
        newest = self._newest_ns
        return max(newest) - min(newest) if len(newest) == len(self._tracks) else 0

    @property
    def late_and_early(self) -> tuple[str, str]:
        """The cameras with the oldest and with the newest stamp, once all have one."""
        by_stamp = sorted(self._tracks, key=lambda name: self._tracks[name].clock.last_ns or 0)
        return by_stamp[0], by_stamp[-1]

    @property
    def lag_ns(self) -> float:
        """How much later than another's the frames of the latest camera usually come."""
        recent = list(self._lags_ns)
        lags_ns = ([lag for name, lag in recent if name == camera] for camera in self._tracks)
        return max((median(each) for each in lags_ns if each), default=0.0)

    def clear(self) -> None:
        """Forget what waits."""
        for track in self._tracks.values():
            track.clear()

    def pass_over(self, until_ns: int) -> None:
        """Drop all frames up to a moment, now and as they come: something newer was shown."""
        self.clear()
        self._passed_ns = until_ns

    def add(self, camera: str, stamp_ns: int, frame: Any, nbytes: int = 0) -> list[Stamped] | None:
        """Add a frame; return the group that it completes, in the order of the cameras.

        Parameters
        ----------
        camera, stamp_ns
            Whose it is, and when it was taken.
        frame
            Anything.
        nbytes
            The memory that it takes while it waits.
        """
        track = self._tracks[camera]
        if track.add(Stamped(stamp_ns, frame), nbytes):
            self._passed_ns = -inf
        self._make_room(camera, stamp_ns)
        if stamp_ns <= self._passed_ns:
            track.clear()
            return None
        tracks = list(self._tracks.values())
        while all(track.waiting for track in tracks):
            stamps = [track.head.stamped.stamp_ns for track in tracks]
            skew_ns = max(stamps) - min(stamps)
            if skew_ns > self.max_skew_ns:
                tracks[stamps.index(min(stamps))].drop()
            elif (loose := _loose(tracks)) is not None:
                loose.drop()
            else:
                self.skews_ns.append(skew_ns)
                self.is_full = False
                return [track.waiting.popleft().stamped for track in tracks]
        return None

    @property
    def _newest_ns(self) -> list[int]:
        """The newest stamp of each camera that has one."""
        stamps = (track.clock.last_ns for track in self._tracks.values())
        return [stamp_ns for stamp_ns in stamps if stamp_ns is not None]

    def _make_room(self, camera: str, stamp_ns: int) -> None:
        """Drop what no camera is late enough for, and the oldest of what is too much.

        Parameters
        ----------
        camera, stamp_ns
            Whose frame came last, and when it was taken.
        """
        lag_ns = max(self._newest_ns) - stamp_ns
        track, tracks = self._tracks[camera], self._tracks.values()
        if lag_ns <= LONGEST_WAIT_NS:
            self._lags_ns.append((camera, lag_ns))
        longest_ns = max((lag for _, lag in self._lags_ns), default=0)
        oldest_ns = stamp_ns - min(longest_ns + self.max_skew_ns, LONGEST_WAIT_NS)
        while len(track.waiting) > _ALWAYS and track.head.stamped.stamp_ns < oldest_ns:
            track.drop()
        while long := [track for track in tracks if len(track.waiting) > _ALWAYS]:
            if sum(track.nbytes for track in tracks) <= ROOM_BYTES:
                return
            max(long, key=lambda track: track.nbytes).drop()
            self.is_full = True


def _loose(tracks: Sequence[_Track]) -> _Track | None:
    """Return the track whose head gives way to its successor, if one does.

    The latest head stays: only what it is grouped with is up for choice.
    """
    heads = [track.head.smooth_ns for track in tracks]
    earliest, latest = min(heads), max(heads)
    jitter_ns = max(track.clock.jitter_ns for track in tracks)
    enough_ns = _CLEARLY * (latest - earliest) - jitter_ns
    if enough_ns <= 0:
        return None
    times = [
        [latest] if head == latest else track.times_ns(latest)
        for head, track in zip(heads, tracks, strict=True)
    ]
    for first in {time for of_track in times for time in of_track if earliest < time <= latest}:
        group = [min((t for t in of_track if t >= first), default=inf) for of_track in times]
        if max(group) - first < enough_ns:
            return tracks[heads.index(earliest)]
    return None
