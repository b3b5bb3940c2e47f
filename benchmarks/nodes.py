"""The nodes end to end: rates, delays and cost, as a subscriber in another process sees them."""

import json
import os
import tempfile
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from math import radians
from pathlib import Path
from subprocess import Popen

import cv2
import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from known_rigs import KnownRig, folder_rig, synthetic_rig
from sensor_msgs.msg import Image
from targets import Requirement

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_testing.domains import unused_domain
from fisheye_testing.health import usage
from fisheye_testing.image_message import stamp_ns
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import IMAGE_INPUT, Watcher

FULL_SPEED_HZ = 1000.0
ONE_CORE = ('taskset', '--cpu-list', '0')
START_TIMEOUT_S = 60.0
CALIBRATIONS = 15
SETTLE_S = 2.0
"""Of the run, left out before what is counted: nothing of the start is in it."""
_TICKS_PER_S = os.sysconf('SC_CLK_TCK')


@dataclass(frozen=True)
class Setup:
    """A rig to run, and what it has to reach: numbers of `Run` by name, the most or the least."""

    name: str
    size: tuple[int, int]
    frame_rate_hz: float = FULL_SPEED_HZ
    composed: bool = True
    rig: str = 'pair'
    """One of `known_rigs.SYNTHETIC_RIGS`, whose pictures are taken once and held in memory."""
    prefix: tuple[str, ...] = ()
    blend: str = 'flow'
    views: tuple[str, ...] = ()
    """Names of views of the node, each of 640x480."""
    are_watched: bool = False
    """Whether somebody subscribes to them."""
    most: dict[str, float] = field(default_factory=dict)
    least: dict[str, float] = field(default_factory=dict)


SMALL, LARGE = (640, 480), (1280, 960)
VIEWS = 'front', 'left_view', 'right_view', 'rear'
SETUPS = (
    Setup(
        'one node 640x480, full speed',
        SMALL,
        most={'memory_mib': 256, 'first_s': 3},
        least={'rate_hz': 100},
    ),
    Setup('the same, on one core', SMALL, prefix=ONE_CORE, least={'rate_hz': 50}),
    Setup('one node 640x480, 30 Hz', SMALL, 30.0, most={'p99_ms': 25}),
    Setup('the same with a feather, 640x480', SMALL, 30.0, blend='feather'),
    Setup('one node 1280x960, full speed', LARGE, least={'rate_hz': 40}),
    Setup('one node 1280x960, 30 Hz', LARGE, 30.0),
    Setup('the same with a feather, 1280x960', LARGE, 30.0, blend='feather'),
    Setup('four views, nobody looks, 30 Hz', SMALL, 30.0, views=VIEWS),
    Setup('four views of 640x480, 30 Hz', SMALL, 30.0, views=VIEWS, are_watched=True),
    Setup('four cameras, full speed', SMALL, rig='ring4', least={'rate_hz': 40}),
    Setup('four cameras, 30 Hz', SMALL, 30.0, rig='ring4', most={'memory_mib': 384}),
    Setup('five nodes 640x480, 30 Hz', SMALL, 30.0, False, most={'p99_ms': 50, 'missing': 0}),
    Setup('five nodes 1280x960, 30 Hz', LARGE, 30.0, False),
)


_PLAIN = 'one node 640x480, 30 Hz'
_SILENT_VIEWS = ('four views, nobody looks, 30 Hz',)
_FLOW_MS = (
    ('one node 640x480, 30 Hz', 'the same with a feather, 640x480', 8.0),
    ('one node 1280x960, 30 Hz', 'the same with a feather, 1280x960', 20.0),
)
"""By how much flow may be later than a feather, p99."""


@dataclass(frozen=True)
class Run:
    """What a subscriber saw of a rig, and what the rig's processes used.

    Attributes
    ----------
    first_s
        From the start of the processes to the first panorama.
    rate_hz
        Panoramas that came a second.
    p50_ms, p95_ms, p99_ms
        Percentiles of the latency from capture to subscriber.
    lost
        Panoramas that were published but did not come.
    missing
        Points of the time grid without a panorama; at full speed nobody counts them.
    cpu_ms
        Processor time of all nodes for one panorama.
    memory_mib
        Resident memory of the largest node.
    calibration_s
        For an answer of calibrate_overlap; of a ring: from the first panorama until it is closed.
    calibrating_p99_ms
        99th percentile of the latency while one answer after another is asked for; None of a ring,
        and at full speed.
    view_hz, view_p99_ms
        Of the slowest view that is watched: pictures a second, and the 99th percentile of the
        latency; None where none is.
    """

    name: str
    first_s: float
    rate_hz: float
    p50_ms: float
    p95_ms: float
    p99_ms: float
    lost: int
    missing: int | None
    cpu_ms: float
    memory_mib: float
    calibration_s: float
    calibrating_p99_ms: float | None = None
    view_hz: float | None = None
    view_p99_ms: float | None = None


class ViewRate:
    """Counts the pictures of a view, and how late they come."""

    def __init__(self, watcher: Watcher, view: str):
        self._latencies_ms: list[float] = []
        watcher.node.create_subscription(Image, f'{view}/image_raw', self._take, IMAGE_INPUT)

    def restart(self) -> None:
        """Forget what came so far."""
        self._latencies_ms = []

    @property
    def count(self) -> int:
        """Pictures that came."""
        return len(self._latencies_ms)

    @property
    def p99_ms(self) -> float:
        """99th percentile of the latency, ms."""
        return float(np.percentile(self._latencies_ms, 99)) if self._latencies_ms else np.inf

    def _take(self, message: Image) -> None:
        self._latencies_ms.append((time.time_ns() - stamp_ns(message.header)) / 1e6)


class Counts:
    """How many panoramas a node says it published, beside how many came."""

    def __init__(self, watcher: Watcher):
        self._watcher = watcher
        self._pairs: list[tuple[int, int]] = []
        watcher.node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 10)

    def restart(self) -> None:
        """Forget what was said so far."""
        self._pairs = []

    @property
    def lost(self) -> int:
        """Published but not received between the first report and the last."""
        if len(self._pairs) < 2:
            return 0
        published, received = np.subtract(self._pairs[-1], self._pairs[0])
        return max(0, int(published - received))

    def _take(self, message: DiagnosticArray) -> None:
        for status in message.status:
            for entry in status.values:
                if entry.key == 'panoramas published':
                    self._pairs.append((int(entry.value), len(self._watcher.stamps_ns)))


def measure_nodes(seconds: float, log_folder: Path) -> Iterator[Run]:
    """Run every setup, each watched for so many seconds."""
    for setup in SETUPS:
        yield run_rig(setup, seconds, log_folder)


def node_targets(runs: Sequence[Run]) -> list[Requirement]:
    """Return the requirements of the nodes."""
    setups = {setup.name: setup for setup in SETUPS}
    targets = []
    for run in runs:
        for limits, is_least in ((setups[run.name].most, False), (setups[run.name].least, True)):
            for what, limit in limits.items():
                measured = getattr(run, what)
                targets.append(Requirement(f'{run.name}, {what}', measured, limit, is_least))
    targets += [
        Requirement(
            f'{run.name}, p99_ms while calibrating', run.calibrating_p99_ms / run.p99_ms, 1.5
        )
        for run in runs
        if run.calibrating_p99_ms is not None
    ]
    p99_ms = {run.name: run.p99_ms for run in runs}
    for name, feather, limit in _FLOW_MS:
        if {name, feather} <= set(p99_ms):
            later_ms = max(0.0, p99_ms[name] - p99_ms[feather])
            targets.append(Requirement(f'{name}, p99_ms later', later_ms, limit))
    cpu_ms = {run.name: run.cpu_ms for run in runs}
    for name in _SILENT_VIEWS:
        if {name, _PLAIN} <= set(cpu_ms):
            ratio = cpu_ms[name] / cpu_ms[_PLAIN]
            targets.append(Requirement(f'{name}, CPU beside none', ratio, 1.05))
    return targets


def run_rig(setup: Setup, seconds: float, log_folder: Path) -> Run:
    """Run a rig on pictures held in memory and watch it for a while."""
    domain = unused_domain()
    with (
        tempfile.TemporaryDirectory() as folder,
        Watcher(domain) as watcher,
        RigProcesses(domain, log_folder) as rig,
    ):
        cameras = save_rig(Path(folder), synthetic_rig(setup.rig), setup.size).cameras
        counts = Counts(watcher)
        begin = time.monotonic()
        values = {'frame_rate_hz': setup.frame_rate_hz}
        if setup.composed:  # five nodes have the default
            values['blend'] = setup.blend
        if setup.views:
            values['views'] = f'[{", ".join(setup.views)}]'
        rig.start_all(setup.composed, cameras, setup.prefix, **values)
        wait_for(lambda: rig.check_alive() or watcher.newest, START_TIMEOUT_S, 'a first panorama')
        first_s = time.monotonic() - begin
        begin = time.monotonic()
        wait_for(lambda: is_whole(watcher, setup), START_TIMEOUT_S, 'a measured rig')
        if len(cameras) == 2:  # a ring may take longer than the service waits, and goes on then
            begin = time.monotonic()
            watcher.calibrate()
        calibration_s = time.monotonic() - begin
        views = [ViewRate(watcher, view) for view in setup.views if setup.are_watched]
        wait_for(lambda: all(view.count for view in views), START_TIMEOUT_S, 'all views')
        time.sleep(SETTLE_S)
        watcher.restart()
        for view in views:
            view.restart()
        counts.restart()
        before_s, begin = cpu_s(rig.processes.values()), time.monotonic()
        time.sleep(seconds)
        stamps_ns, latencies_ms = watcher.stamps_ns[:], watcher.latencies_ms[:]
        views_hz = [view.count / (time.monotonic() - begin) for view in views]
        used_s, passed_s = cpu_s(rig.processes.values()) - before_s, time.monotonic() - begin
        calibrating_p99_ms = None
        if len(cameras) == 2 and setup.frame_rate_hz != FULL_SPEED_HZ:
            calibrating_p99_ms = _calibrating_p99_ms(watcher)
        rig.check_alive()
        due = round((stamps_ns[-1] - stamps_ns[0]) * 1e-9 * setup.frame_rate_hz) + 1
        is_free = setup.frame_rate_hz == FULL_SPEED_HZ
        return Run(
            setup.name,
            first_s,
            len(stamps_ns) / passed_s,
            *(float(v) for v in np.percentile(latencies_ms, (50, 95, 99))),
            lost=counts.lost,
            missing=None if is_free else due - len(stamps_ns),
            cpu_ms=used_s / len(stamps_ns) * 1e3,
            memory_mib=max(usage(process.pid).resident_mib for process in rig.processes.values()),
            calibration_s=calibration_s,
            calibrating_p99_ms=calibrating_p99_ms,
            view_hz=min(views_hz, default=None),
            view_p99_ms=max((view.p99_ms for view in views), default=None),
        )


def _calibrating_p99_ms(watcher: Watcher) -> float:
    watcher.restart()
    for _ in range(CALIBRATIONS):
        watcher.calibrate()
    return float(np.percentile(watcher.latencies_ms, 99))


def is_whole(watcher: Watcher, setup: Setup) -> bool:
    """Whether all overlaps were found, and the panorama of a ring is closed."""
    overlaps, projection = watcher.overlaps, watcher.projection
    is_closed = synthetic_rig(setup.rig).is_closed
    return (
        projection is not None
        and projection.wraps == is_closed
        and overlaps is not None
        and all(overlap.found for overlap in overlaps.overlaps)
    )


def save_rig(folder: Path, rig: KnownRig, size: tuple[int, int]) -> KnownRig:
    """Write images and calibrations of a synthetic rig, and return the rig that reads them."""
    lens, scene = synthetic_lens(*size, radians(CaptureSettings().synthetic_fov_deg)), Scene()
    for name, attitude in zip(rig.cameras, rig.attitudes, strict=True):
        cv2.imwrite(str(folder / f'{name}.png'), scene.view(lens, attitude).frame(0))
        write_camera(folder / f'{name}.yaml', Camera(name, lens))
    (folder / 'truth.json').write_text(json.dumps({'cameras': list(rig.cameras)}))
    return folder_rig(folder)


def cpu_s(processes: Iterable[Popen]) -> float:
    """Processor time that processes have used."""
    return sum(_ticks(process.pid) for process in processes) / _TICKS_PER_S


def _ticks(pid: int) -> int:
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return int(fields[11]) + int(fields[12])
