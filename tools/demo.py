"""The main job, shown: five real nodes make a panorama; it is measured and saved."""

import argparse
import json
import math
import re
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from contact_sheet import contact_sheet, with_particles

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FisheyeError, OverlapError
from fisheye_geometry.camera_file import read_camera
from fisheye_testing.rig import SIDES, RigProcesses, camera_parameters, unused_domain
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher
from fisheye_undistort.correction import Correction
from fisheye_undistort.undistort_settings import UndistortSettings

SYNTHETIC_OFFSET_DEG = 140.0
START_TIMEOUT_S = 60.0


def main() -> int:
    """Run the demonstration; the exit code says whether a panorama came."""
    arguments = parse()
    domain = unused_domain()
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    for former in (out / 'log').glob('*.log'):
        former.unlink()
    with RigProcesses(domain, out / 'log') as rig:
        what = arguments.rig or 'the synthetic rig'
        nodes = 'one node' if arguments.composed else 'five nodes'
        print(f'Starting {nodes} on {what} in ROS_DOMAIN_ID={domain} ...', flush=True)
        begin = time.monotonic()
        cameras = camera_parameters(arguments.rig)
        rig.start_all(arguments.composed, cameras, frame_rate_hz=arguments.rate)
        if arguments.view:
            view(rig, arguments.view)
            return 0
        with Watcher(domain) as watcher:
            try:
                demonstrate(rig, watcher, begin, arguments)
            except (FisheyeError, TimeoutError) as error:
                raise RuntimeError(f'{error}\n{rig.last_warnings()}') from error
    print('To look around in it, live in a browser: make view')
    return 0


def view(rig: RigProcesses, host: str) -> None:
    """Show the panorama in browsers until Ctrl-C."""
    rig.start('viewer', host=host)
    address = wait_for(
        lambda: rig.check_alive() or re.search(r'http://\S+', rig.log('viewer').read_text()),
        START_TIMEOUT_S,
        'the start of the viewer',
    )
    print(f'The panorama is at {address[0]} in a browser. Ctrl-C ends it.', flush=True)
    try:
        while True:
            rig.check_alive()
            time.sleep(0.5)
    except KeyboardInterrupt:
        print()


def demonstrate(
    rig: RigProcesses, watcher: Watcher, begin: float, arguments: argparse.Namespace
) -> None:
    """Measure and save what the rig gives; `begin` is when it was started."""
    wait_for(lambda: rig.check_alive() or watcher.newest, START_TIMEOUT_S, 'a first panorama')
    print(f'First panorama after {time.monotonic() - begin:.1f} s.', flush=True)
    answer = watcher.calibrate()
    if not answer.success:
        raise OverlapError(answer.message)
    print(f'/calibrate_overlap: {answer.message}')
    watch(watcher, rig, arguments.seconds)
    report(watcher, answer, arguments)
    cv2.imwrite(str(arguments.out / 'panorama.png'), watcher.picture())
    drawn = sheet(watcher, answer.overlaps[0], arguments.rig)
    cv2.imwrite(str(arguments.out / 'contact_sheet.png'), drawn)
    print(f'Saved panorama.png and contact_sheet.png in {arguments.out}')


def sheet(watcher: Watcher, overlap, folder: Path | None) -> np.ndarray:
    """Draw how the panorama came about: raw, corrected with the overlap's particles, stitched."""
    raw = [watcher.picture_on(f'{side}/image_raw') for side in SIDES]
    if watcher.node.count_publishers('left/image_rect'):
        left, right = (watcher.picture_on(f'{side}/image_rect') for side in SIDES)
    else:
        left, right = (corrected(*entry, folder) for entry in zip(raw, SIDES, strict=True))
    half = left.shape[1] - left.shape[1] // 2
    left = with_particles(left, overlap.left_particles, overlap.left_match, half)
    right = with_particles(right, overlap.right_particles, overlap.right_match, 0)
    return contact_sheet(
        [
            [(f'{side}/image_raw', picture) for side, picture in zip(SIDES, raw, strict=True)],
            [('left, corrected', left), ('right, corrected', right)],
            [('panorama/image', watcher.picture())],
        ]
    )


def corrected(raw: np.ndarray, side: str, folder: Path | None) -> np.ndarray:
    """Correct a picture as one node does it, which publishes raw pictures and panoramas only."""
    if folder:
        lens = read_camera(folder / f'{side}.yaml').lens
    else:
        fov_rad = math.radians(CaptureSettings().synthetic_fov_deg)
        lens = synthetic_lens(*raw.shape[1::-1], fov_rad)
    correction = Correction(lens, UndistortSettings())
    surface = correction.surface
    picture = np.empty((surface.height, surface.width, *raw.shape[2:]), np.uint8)
    correction(raw, picture)
    return picture


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--rig', type=Path, help='folder with left/right .png and .yaml')
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    parser.add_argument('--seconds', type=float, default=5.0, help='how long to watch')
    parser.add_argument('--rate', type=float, default=30.0, help='frames a second')
    parser.add_argument('--composed', action='store_true', help='one process instead of five')
    parser.add_argument(
        '--view',
        nargs='?',
        const='127.0.0.1',
        metavar='HOST',
        help='show it in a browser instead; 0.0.0.0 as HOST lets other machines look too',
    )
    arguments = parser.parse_args()
    for side in ('left', 'right') if arguments.rig else ():
        for suffix in ('png', 'yaml'):
            if not (path := arguments.rig / f'{side}.{suffix}').is_file():
                parser.error(f'{path} is not there; expected left and right .png and .yaml')
    return arguments


def watch(watcher: Watcher, rig: RigProcesses, seconds: float) -> None:
    """Count panoramas for a while, two at least, with a line that shows that they come."""
    watcher.restart()
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        rig.check_alive()
        time.sleep(min(0.25, left))
        if sys.stdout.isatty():
            print(f'\r{len(watcher.stamps_ns)} panoramas ...', end='', flush=True)
    if sys.stdout.isatty():
        print('\r', end='')
    wait_for(
        lambda: rig.check_alive() or len(watcher.stamps_ns) > 1, START_TIMEOUT_S, 'two panoramas'
    )


def report(watcher: Watcher, answer, arguments: argparse.Namespace) -> None:
    """Print the offset against the truth, and what came at which rate and age."""
    overlap = answer.overlaps[0]
    true_deg = true_offset_deg(arguments.rig)
    true = 'not known'
    if true_deg is not None:
        true = (
            f'{watcher.projection.focal_px * math.radians(true_deg):.2f} px ({true_deg:.2f} deg)'
        )
    found = 'no overlap'
    if overlap.found:
        found = f'{overlap.offset_x_px:.2f} px ({overlap.offset_deg:.2f} deg)'
    print(f'Offset: found {found}, true {true}')
    print(f'Confidence {overlap.confidence:.2f}, by {overlap.method}')
    seconds = (watcher.stamps_ns[-1] - watcher.stamps_ns[0]) / 1e9
    p50, p99 = np.percentile(watcher.latencies_ms, (50, 99))
    print(
        f'{len(watcher.stamps_ns)} panoramas of {watcher.newest.width}x{watcher.newest.height} '
        f'px, {(len(watcher.stamps_ns) - 1) / seconds:.1f} a second; '
        f'latency {p50:.0f} ms (p99 {p99:.0f} ms) from camera to subscriber'
    )


def true_offset_deg(folder: Path | None) -> float | None:
    """Return the offset that is known of a rig, deg; None where none is."""
    if folder is None:
        return SYNTHETIC_OFFSET_DEG
    path = folder / 'truth.json'
    truth = json.loads(path.read_text()) if path.is_file() else {}
    return truth.get('offset_deg') if truth.get('overlaps') else None


if __name__ == '__main__':
    try:
        sys.exit(main())
    except (FisheyeError, RuntimeError, TimeoutError) as error:
        sys.exit(f'The demonstration failed: {error}')
    except KeyboardInterrupt:
        sys.exit(130)
