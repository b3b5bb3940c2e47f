"""The main job, shown: real nodes make a panorama; it is measured and saved."""

import argparse
import math
import sys
import time
from pathlib import Path

import cv2
import numpy as np
from contact_sheet import contact_sheet, with_particles
from known_rigs import SYNTHETIC_RIGS, KnownRig, folder_rig, synthetic_rig

from fisheye_capture.capture_settings import CaptureSettings
from fisheye_capture.synthetic import synthetic_lens
from fisheye_capture.town import EYE_HEIGHT_M
from fisheye_core.errors import FisheyeError
from fisheye_geometry.camera_file import read_camera
from fisheye_testing.domains import unused_domain
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher
from fisheye_undistort.correction import Correction
from fisheye_undistort.undistort_settings import UndistortSettings
from panorama_stitch.launch_arguments import camera_names

START_TIMEOUT_S = 60.0
SYNTHETIC_ROBOT = {'robot_width_m': 1.2, 'camera_height_m': EYE_HEIGHT_M}


def main() -> int:
    """Run the demonstration; the exit code says whether a panorama came."""
    arguments = parse()
    domain = unused_domain()
    out = arguments.out
    out.mkdir(parents=True, exist_ok=True)
    for former in (out / 'log').glob('*.log'):
        former.unlink()
    with RigProcesses(domain, out / 'log') as rig:
        cameras = arguments.known.cameras
        what = f'{arguments.rig} ({", ".join(cameras)})'
        nodes = 'one node' if arguments.composed else f'{2 * len(cameras) + 1} nodes'
        print(f'Starting {nodes} on {what} in ROS_DOMAIN_ID={domain} ...', flush=True)
        begin = time.monotonic()
        common = {**arguments.known.common, 'frame_rate_hz': arguments.rate}
        rig.start_all(arguments.composed, cameras, **common)
        if arguments.view:
            view(rig, arguments.view, SYNTHETIC_ROBOT if arguments.rig in SYNTHETIC_RIGS else {})
            return 0
        with Watcher(domain) as watcher:
            try:
                demonstrate(rig, watcher, begin, arguments)
            except (FisheyeError, TimeoutError) as error:
                raise RuntimeError(f'{error}\n{rig.last_warnings()}') from error
    print('To look around in it, live in a browser: make view')
    return 0


def view(rig: RigProcesses, host: str, robot: dict[str, float]) -> None:
    """Show the panorama in browsers until Ctrl-C."""
    rig.start('viewer', host=host, **robot)
    address = rig.page_url(START_TIMEOUT_S)
    print(f'The panorama is at {address} in a browser. Ctrl-C ends it.', flush=True)
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
    print(f'/calibrate_overlap: {answer.message}')
    if not answer.success:  # on a busy machine it goes on
        measured(rig, watcher)
    overlaps = answer.overlaps if answer.success else watcher.overlaps.overlaps
    watch(watcher, rig, arguments.seconds)
    report(watcher, overlaps, arguments)
    cv2.imwrite(str(arguments.out / 'panorama.png'), watcher.picture())
    drawn = sheet(watcher, overlaps, arguments.known)
    cv2.imwrite(str(arguments.out / 'contact_sheet.png'), drawn)
    print(f'Saved panorama.png and contact_sheet.png in {arguments.out}')


def measured(rig: RigProcesses, watcher: Watcher) -> None:
    """Wait until every overlap was looked for."""
    wait_for(
        lambda: rig.check_alive() or watcher.is_measured,
        START_TIMEOUT_S,
        'the measurement of the overlaps',
    )


def sheet(watcher: Watcher, overlaps, rig: KnownRig) -> np.ndarray:
    """Draw how the panorama came about: raw, corrected with the overlaps' particles, stitched."""
    raw = {name: watcher.picture_on(f'{name}/image_raw') for name in rig.cameras}
    if watcher.node.count_publishers(f'{next(iter(raw))}/image_rect'):
        drawn = {name: watcher.picture_on(f'{name}/image_rect') for name in raw}
    else:
        drawn = {name: corrected(raw[name], {**rig.cameras[name], **rig.common}) for name in raw}
    for overlap in overlaps:
        left, right = overlap.left_camera, overlap.right_camera
        half = drawn[left].shape[1] - drawn[left].shape[1] // 2
        drawn[left] = with_particles(drawn[left], overlap.left_particles, overlap.left_match, half)
        drawn[right] = with_particles(
            drawn[right], overlap.right_particles, overlap.right_match, 0
        )
    return contact_sheet(
        [
            [(f'{name}/image_raw', picture) for name, picture in raw.items()],
            [(f'{name}, corrected', picture) for name, picture in drawn.items()],
            [('panorama/image', watcher.picture())],
        ]
    )


def corrected(raw: np.ndarray, camera: dict[str, object]) -> np.ndarray:
    """Correct a picture as one node does it, which publishes raw pictures and panoramas only."""
    if 'camera_info_url' in camera:
        lens = read_camera(camera['camera_info_url']).lens
    else:
        fov_deg = camera.get('synthetic_fov_deg', CaptureSettings().synthetic_fov_deg)
        lens = synthetic_lens(*raw.shape[1::-1], math.radians(fov_deg))
    correction = Correction(lens, UndistortSettings())
    surface = correction.surface
    picture = np.empty((surface.height, surface.width, *raw.shape[2:]), np.uint8)
    correction(raw, picture)
    return picture


def parse() -> argparse.Namespace:
    """Read the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        '--rig',
        default='pair',
        help=f'{", ".join(SYNTHETIC_RIGS)}, or a folder with .png and .yaml of each camera',
    )
    parser.add_argument(
        '--cameras',
        type=camera_names,
        metavar='NAMES',
        default=[],
        help='those of a folder from left to right, a ring clockwise as seen from above: '
        'front,right,rear,left (default: in the order of their names)',
    )
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    parser.add_argument('--seconds', type=float, default=5.0, help='how long to watch')
    parser.add_argument('--rate', type=float, default=30.0, help='frames a second')
    parser.add_argument('--composed', action='store_true', help='one process instead of several')
    parser.add_argument(
        '--view',
        nargs='?',
        const='127.0.0.1',
        metavar='HOST',
        help='show it in a browser instead; 0.0.0.0 as HOST lets other machines look too',
    )
    arguments = parser.parse_args()
    try:
        arguments.known = known_rig(arguments.rig, arguments.cameras)
    except FileNotFoundError as error:
        parser.error(str(error))
    return arguments


def known_rig(name: str, cameras: list[str]) -> KnownRig:
    """Return the rig that a name or a folder means, in which cameras may be named."""
    if name in SYNTHETIC_RIGS and not cameras:
        return synthetic_rig(name)
    if not Path(name).is_dir():
        raise FileNotFoundError(
            f'--rig is {name}; expected {", ".join(SYNTHETIC_RIGS)}, or a folder, which --cameras '
            'needs'
        )
    return folder_rig(Path(name), cameras)


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


def report(watcher: Watcher, overlaps, arguments: argparse.Namespace) -> None:
    """Print what was found against the truth, and what came at which rate and age."""
    known = arguments.known
    truth = iter(known.between())
    for overlap in overlaps:
        found = 'no overlap'
        if overlap.found:
            found = (
                f'{overlap.offset_x_px:.2f} px ({overlap.offset_deg:.2f} deg), pitch '
                f'{overlap.pitch_deg:.2f}, roll {overlap.roll_deg:.2f} deg'
            )
        true, attitude = 'not known', next(truth, None)
        if attitude:
            pitch_deg, roll_deg = map(math.degrees, (attitude.pitch_rad, attitude.roll_rad))
            true = f'{math.degrees(attitude.yaw_rad):.2f} deg, pitch {pitch_deg:.2f}, roll '
            true += f'{roll_deg:.2f} deg'
        elif known.offset_deg is not None:
            offset_px = watcher.projection.focal_px * math.radians(known.offset_deg)
            true = f'{offset_px:.2f} px ({known.offset_deg:.2f} deg)'
        print(f'{overlap.left_camera} - {overlap.right_camera}: found {found}, true {true}')
        print(f'  confidence {overlap.confidence:.2f}, by {overlap.method}')
    if watcher.projection.wraps:
        print('The ring is closed: the panorama is 360 degrees wide.')
    seconds = (watcher.stamps_ns[-1] - watcher.stamps_ns[0]) / 1e9
    p50, p99 = np.percentile(watcher.latencies_ms, (50, 99))
    print(
        f'{len(watcher.stamps_ns)} panoramas of {watcher.newest.width}x{watcher.newest.height} '
        f'px, {(len(watcher.stamps_ns) - 1) / seconds:.1f} a second; '
        f'latency {p50:.0f} ms (p99 {p99:.0f} ms) from camera to subscriber'
    )


if __name__ == '__main__':
    try:
        sys.exit(main())
    except (FisheyeError, RuntimeError, TimeoutError) as error:
        sys.exit(f'The demonstration failed: {error}')
    except KeyboardInterrupt:
        sys.exit(130)
