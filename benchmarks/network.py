"""How old the pictures of network cameras are at /panorama/image: painted in, read back, compared.

Two cameras of a kind run on loopback, with the time painted into each picture; panorama_node
stitches them. What the panorama's stamp says of its age stands beside what is painted in it.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from math import radians
from pathlib import Path
from threading import Event, Thread

import numpy as np

from fisheye_bridge.images import to_array
from fisheye_bridge.stamps import ns_of
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_testing import network_camera
from fisheye_testing.domains import unused_domain
from fisheye_testing.painted_time import BLOCKS, age_ms, centres_px, read
from fisheye_testing.rig import SIDES, RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

SIZE = 640, 480
FOV_DEG, OFFSET_PX = 170.0, 527.0
"""Of the lenses, and between their axes, about 140 degrees."""
KINDS = {
    'RTSP, H.264, TCP': (['rtsp'], {}),
    'RTSP, H.264, UDP': (['rtsp'], {'rtsp_transport': 'udp'}),
    'RTSP, MJPEG': (['rtsp', '--codec', 'mjpeg'], {}),
    'MPEG-TS over UDP': (['udp'], {}),
    'MPEG-TS over HTTP': (['ts'], {}),
    'HTTP, multipart JPEG': (['mjpeg'], {}),
    'HTTP, snapshots': (['snapshot'], {}),
    'HLS': (['hls'], {}),
}
_RUN_S, _STOP_S = 0.006, 0.09
"""A slow consumer runs so long and is stopped so long, again and again."""


def main() -> None:
    """Print a row of the table for each kind of camera."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=20.0, help='of each measurement')
    parser.add_argument('--rate', type=float, default=30.0, help='pictures a second')
    parser.add_argument('--kinds', nargs='*', default=list(KINDS), choices=list(KINDS))
    arguments = parser.parse_args()
    print(
        '| camera | consumer | panoramas a second | true age p50, p99, ms | true - told p50, ms |'
    )
    print('| --- | --- | --- | --- | --- |')
    for kind in arguments.kinds:
        for is_slow in (False, True):
            true, told = measure(kind, arguments.rate, arguments.seconds, is_slow)
            p50, p99 = np.percentile(true, (50, 99))
            print(
                f'| {kind} | {"slow" if is_slow else "normal"} | '
                f'{len(true) / arguments.seconds:.1f} | {p50:.0f}, {p99:.0f} | '
                f'{np.median(true - told):+.0f} |',
                flush=True,
            )


def measure(kind: str, rate_hz: float, seconds: float, is_slow: bool):
    """Return the true and the told ages, ms, of the panoramas of some seconds."""
    options, parameters = KINDS[kind]
    lens = synthetic_lens(*SIZE, radians(FOV_DEG))
    with (
        tempfile.TemporaryDirectory() as folder,
        cameras([*options, '--rate', str(rate_hz)]) as (urls),
    ):
        own = {}
        for side, url in zip(SIDES, urls, strict=True):
            calibration = Path(folder, f'{side}.yaml')
            write_camera(calibration, Camera(side, lens))
            own |= {f'{side}.source': url, f'{side}.camera_info_url': str(calibration)}
            own |= {f'{side}.{name}': value for name, value in parameters.items()}
        own['offset_x_px'] = f'[{OFFSET_PX}]'
        domain = unused_domain()
        with RigProcesses(domain, Path(folder, 'log')) as rig, Ages(domain, lens) as ages:
            rig.start('panorama', frame_rate_hz=rate_hz, **own)
            wait_for(lambda: len(ages.true_ms) > 2 * rate_hz, 60, f'panoramas of {kind}')
            with slowed(rig.processes['panorama'].pid, is_slow):
                ages.restart()
                time.sleep(seconds)
                return np.array(ages.true_ms), np.array(ages.told_ms)


class Ages(Watcher):
    """Reads from each panorama the time that is painted into the left camera's pictures."""

    def __init__(self, domain: int, lens):
        self.true_ms, self.told_ms = [], []
        row = np.full(BLOCKS, lens.height / 2 - 0.5)
        rays, _ = lens.unproject(np.column_stack([centres_px(lens.width), row]))
        self._azimuths_rad = np.arctan2(rays[:, 0], rays[:, 2])
        super().__init__(domain)

    @property
    def places(self) -> tuple[float, list[float]]:
        """Row and columns of the painted blocks, as shares of the panorama."""
        view = self.projection
        shares = (self._columns(view) + 0.5) / view.width
        return (view.center_y_px + 0.5) / view.height, shares.tolist()

    def _columns(self, view) -> np.ndarray:
        return view.center_x_px - OFFSET_PX / 2 + view.focal_px * self._azimuths_rad

    def restart(self) -> None:
        """Forget what came so far."""
        super().restart()
        self.true_ms, self.told_ms = [], []

    def _take(self, message) -> None:
        now_ns = time.time_ns()
        super()._take(message)
        view = self.projection
        if view is None:
            return
        columns = np.rint(self._columns(view)).astype(int)
        row = round(view.center_y_px)
        image = to_array(message)[0]
        painted_ms = read(image[row - 1 : row + 2, columns].mean(axis=(0, 2)))
        if painted_ms is not None:
            self.true_ms.append(age_ms(painted_ms, now_ns))
            self.told_ms.append((now_ns - ns_of(message.header.stamp)) / 1e6)


@contextmanager
def cameras(options):
    """Run two cameras; give their addresses."""
    command = [sys.executable, network_camera.__file__, *options]
    processes = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in SIDES]
    try:
        yield [process.stdout.readline().strip() for process in processes]
    finally:
        for process in processes:
            process.kill()
            process.wait()
            process.stdout.close()


@contextmanager
def slowed(pid: int, is_slow: bool):
    """Leave a process only some of the time."""
    is_done = Event()

    def run():
        while not is_done.wait(_RUN_S):
            os.kill(pid, signal.SIGSTOP)
            is_done.wait(_STOP_S)
            os.kill(pid, signal.SIGCONT)

    thread = Thread(target=run if is_slow else is_done.wait)
    thread.start()
    try:
        yield
    finally:
        is_done.set()
        thread.join()


if __name__ == '__main__':
    main()
