"""Stamps of cameras that run free, and what becomes of them when they are paired."""

import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

EPOCH_NS = 1_700_000_000 * 10**9
MAX_SKEW_NS = 100_000_000
_CLOSEST_MS = 0.5
"""No camera gives two frames at once."""


@dataclass(frozen=True)
class CameraTiming:
    """How one camera's frames come.

    Attributes
    ----------
    rate_hz, phase_ms
        When its frames are due.
    jitter_ms
        Stamps lie up to so far off that, evenly distributed.
    lost
        Share of the frames that never come.
    late_ms
        How long after its stamp a frame comes.
    """

    rate_hz: float
    phase_ms: float = 0.0
    jitter_ms: float = 0.0
    lost: float = 0.0
    late_ms: float = 0.0

    def stamps_ms(self, seconds: float, chance: random.Random) -> list[float]:
        """Return the stamps of the frames that come."""
        stamps, last = [], -1e9
        for index in range(int(seconds * self.rate_hz)):
            due = self.phase_ms + 1000 * index / self.rate_hz
            last = max(due + chance.uniform(-self.jitter_ms, self.jitter_ms), last + _CLOSEST_MS)
            if chance.random() >= self.lost:
                stamps.append(last)
        return stamps


@dataclass(frozen=True)
class Paired:
    """What came of it.

    Attributes
    ----------
    groups
        Stamps of each group, ns, in the order of the cameras.
    share
        Groups for each frame of the slowest camera.
    gap_periods
        Longest time from group to group, in periods of the slowest camera.
    skew_ms, worst_skew_ms
        Median and largest spread of stamps within a group.
    """

    groups: list[list[int]]
    share: float
    gap_periods: float
    skew_ms: float
    worst_skew_ms: float


def pair_frames(
    make_pairing: Callable[[Sequence[str], int], Any],
    cameras: Sequence[CameraTiming],
    *,
    seconds: float = 20.0,
    seed: int = 0,
    warm_up: int = 10,
) -> Paired:
    """Pair the frames of cameras as they come, and leave the first groups out of the figures.

    Parameters
    ----------
    make_pairing
        Builds what pairs, a `FramePairing`, from names and the largest skew, ns.
    cameras
        How the frames come.
    seconds, seed, warm_up
        For how long, by which chance, and how many groups are left out.
    """
    chance = random.Random(seed)
    stamps = [camera.stamps_ms(seconds, chance) for camera in cameras]
    arrivals = sorted(
        (stamp_ms + camera.late_ms, index, EPOCH_NS + round(stamp_ms * 1e6))
        for index, camera in enumerate(cameras)
        for stamp_ms in stamps[index]
    )
    names = [str(index) for index in range(len(cameras))]
    pairing = make_pairing(names, MAX_SKEW_NS)
    groups, times_ms = [], []
    for arrival_ms, index, stamp_ns in arrivals:
        if group := pairing.add(names[index], stamp_ns, None):
            groups.append([member.stamp_ns for member in group])
            times_ms.append(arrival_ms)
    # Frames that come before or after those of the others have no partner to find.
    begin = max(of_camera[0] for of_camera in stamps) - 1000 / max(c.rate_hz for c in cameras)
    end = min(of_camera[-1] for of_camera in stamps)
    due = min(sum(begin <= stamp <= end for stamp in of_camera) for of_camera in stamps)
    spreads = sorted((max(group) - min(group)) / 1e6 for group in groups[warm_up:])
    gaps_ms = [later - former for former, later in pairwise(times_ms[warm_up:])]
    slowest_hz = min(camera.rate_hz for camera in cameras)
    return Paired(
        groups,
        len(groups) / max(due, 1),
        max(gaps_ms, default=0.0) * slowest_hz / 1000,
        spreads[len(spreads) // 2] if spreads else 0.0,
        spreads[-1] if spreads else 0.0,
    )
