"""How a rig fares: when its panorama was whole, what its nodes say, what they use."""

import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from fisheye_testing.image_message import stamp_ns, to_array
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

_BRIGHT_SHARE = 0.7
"""A side darker than this share of its usual level is dimmed."""
_LONG_GAP_S = 0.4
"""Between two panoramas; shorter ones are the breath of a busy machine."""
_SETTLED = 60
"""Panoramas that look alike: for longer than a camera that a busy machine holds up is dimmed."""
_STEP_PX = 8
_START_S = 60.0
_LOOKS = 5


class SeenPanorama(NamedTuple):
    """A panorama that came.

    Attributes
    ----------
    arrived_s
        On the monotonic clock.
    stamp_ns
        Of its message.
    levels
        Mean grey levels of its left and of its right quarter.
    """

    arrived_s: float
    stamp_ns: int
    levels: tuple[float, float]


class Health(Watcher):
    """A watcher that remembers how every panorama looked, and the last word of every node.

    Attributes
    ----------
    seen : list of SeenPanorama
        Every panorama since `settle`.
    status : dict
        `DiagnosticStatus` by the node's name, as `left/capture`.
    """

    def __init__(self, domain: int, namespace: str = ''):
        self.seen: list[SeenPanorama] = []
        self.status: dict[str, DiagnosticStatus] = {}
        self._usual: np.ndarray = np.zeros(2)
        super().__init__(domain, namespace)
        self.node.create_subscription(DiagnosticArray, '/diagnostics', self._take_status, 50)

    def settle(self) -> None:
        """Wait until panoramas come steadily, and take what they show for the usual."""
        self.seen = []

        def steady():
            levels = np.array([entry.levels for entry in self.seen[-_SETTLED:]])
            return len(levels) == _SETTLED and (np.ptp(levels, axis=0) < 5).all()

        wait_for(steady, _START_S, 'a steady panorama')
        self._usual = np.array(self.seen[-1].levels)

    def is_dim(self, entry: SeenPanorama) -> tuple[bool, bool]:
        """Whether the left and the right side of a panorama are dimmed."""
        left, right = np.array(entry.levels) < _BRIGHT_SHARE * self._usual
        return left, right

    def whole(self, since_s: float) -> bool:
        """Whether a panorama with both sides live came since a time."""
        return any(e.arrived_s > since_s and not any(self.is_dim(e)) for e in self.seen[-5:])

    def suffering(self, begin_s: float) -> tuple[float, float, float]:
        """How long no panorama came, the left and the right side were dim since a time, s."""
        entries = [entry for entry in self.seen if entry.arrived_s >= begin_s - _LONG_GAP_S]
        arrivals = np.array([entry.arrived_s for entry in entries] + [time.monotonic()])
        gaps = np.diff(arrivals)
        dim = np.array([self.is_dim(entry) for entry in entries])
        shown = np.minimum(gaps, _LONG_GAP_S)
        left, right = shown @ dim
        return float(gaps[gaps > _LONG_GAP_S].sum()), float(left), float(right)

    def came_in_order(self, since_s: float) -> bool:
        """Whether each panorama since a time was later than the one before."""
        stamps = [entry.stamp_ns for entry in self.seen if entry.arrived_s > since_s]
        return stamps == sorted(set(stamps))

    def level(self, node: str) -> bytes:
        """Return the last level of a node in /diagnostics; STALE where there is none."""
        return self.status[node].level if node in self.status else DiagnosticStatus.STALE

    def value(self, node: str, key: str) -> str | None:
        """Return a value of a node's last diagnostics, None where there is none."""
        entries = self.status[node].values if node in self.status else ()
        return next((entry.value for entry in entries if entry.key == key), None)

    def _take(self, message) -> None:
        super()._take(message)
        image = to_array(message)[::_STEP_PX, ::_STEP_PX]
        quarter = image.shape[1] // 4
        levels = float(image[:, :quarter].mean()), float(image[:, -quarter:].mean())
        self.seen.append(SeenPanorama(time.monotonic(), stamp_ns(message.header), levels))

    def _take_status(self, message) -> None:
        self.status.update({status.name: status for status in message.status})


class Usage(NamedTuple):
    """What a process uses; of its resident memory, what it shares with others apart."""

    resident_mib: float
    shared_mib: float
    files: int
    threads: int


def usage(pid: int) -> Usage:
    """Return what a process uses now; what it opens for a moment only is not counted."""
    folder = Path(f'/proc/{pid}')
    resident, shared = (int(pages) / 256 for pages in (folder / 'statm').read_text().split()[1:3])
    files, threads = (
        min(len(list((folder / part).iterdir())) for _ in range(_LOOKS)) for part in ('fd', 'task')
    )
    return Usage(resident, shared, files, threads)
