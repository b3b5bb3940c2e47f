"""Pairing: frames of several cameras that were taken at the same time."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

_WAITING = 4
"""Frames of one camera that may wait for their partners."""
_GAPS = 8
"""Recent gaps between frames from which a camera's period is known."""
_SKEWS = 300
"""Recent pairs of which the skew is remembered."""


class Stamped(NamedTuple):
    """A frame and when it was taken."""

    stamp_ns: int
    frame: Any


@dataclass
class _Track:
    """What waits of one camera."""

    waiting: deque = field(default_factory=lambda: deque(maxlen=_WAITING))
    gaps: deque = field(default_factory=lambda: deque(maxlen=_GAPS))
    last_ns: int | None = None
    unpaired: int = 0

    def add(self, new: Stamped) -> None:
        if self.last_ns is not None:
            if new.stamp_ns <= self.last_ns:
                # The clock jumped back: what waits belongs to another time.
                self.drop_before(len(self.waiting))
                self.gaps.clear()
            else:
                self.gaps.append(new.stamp_ns - self.last_ns)
        self.last_ns = new.stamp_ns
        self.unpaired += len(self.waiting) == _WAITING
        self.waiting.append(new)

    def drop_before(self, index: int) -> None:
        self.unpaired += index
        for _ in range(index):
            self.waiting.popleft()

    def nearest(self, stamp_ns: int) -> int | None:
        """Index of the waiting frame nearest in time; None if there is none or a nearer is due."""
        if not self.waiting:
            return None
        index = min(
            range(len(self.waiting)), key=lambda i: abs(self.waiting[i].stamp_ns - stamp_ns)
        )
        skew = abs(self.waiting[index].stamp_ns - stamp_ns)
        if self.gaps and abs(self.last_ns + min(self.gaps) - stamp_ns) < skew:
            return None
        return index


class FramePairing:
    """Groups the frames of several cameras by their stamps, within bounded memory.

    Frames come in any order. A group is given as soon as its last frame comes; frames that are
    older than a group that was given are dropped and counted.

    Attributes
    ----------
    skews_ns : deque of int
        Largest difference of stamps within each of the recent groups.
    """

    def __init__(self, cameras: Sequence[str], max_skew_ns: int):
        self._tracks = {camera: _Track() for camera in cameras}
        self.max_skew_ns = max_skew_ns
        self.skews_ns: deque[int] = deque(maxlen=_SKEWS)

    @property
    def unpaired(self) -> dict[str, int]:
        """How many frames of each camera found no partner."""
        return {camera: track.unpaired for camera, track in self._tracks.items()}

    @property
    def spread_ns(self) -> int:
        """How far apart the newest stamps of the cameras lie; 0 before all have one."""
        newest = [track.last_ns for track in self._tracks.values()]
        return 0 if None in newest else max(newest) - min(newest)

    def clear(self) -> None:
        """Forget what waits."""
        for track in self._tracks.values():
            track.drop_before(len(track.waiting))

    def add(self, camera: str, stamp_ns: int, frame: Any) -> list[Stamped] | None:
        """Take a frame; give the group that it completes, in the order of the cameras."""
        self._tracks[camera].add(Stamped(stamp_ns, frame))
        indices = {name: track.nearest(stamp_ns) for name, track in self._tracks.items()}
        indices[camera] = len(self._tracks[camera].waiting) - 1
        if None in indices.values():
            return None
        group = [self._tracks[name].waiting[index] for name, index in indices.items()]
        stamps = [member.stamp_ns for member in group]
        skew_ns = max(stamps) - min(stamps)
        if skew_ns > self.max_skew_ns:
            return None
        for name, index in indices.items():
            self._tracks[name].drop_before(index)
            self._tracks[name].waiting.popleft()
        self.skews_ns.append(skew_ns)
        return group
