"""From glass to glass: how old what a browser shows is, by stage, on loopback and on slow links.

Two synthetic cameras turn, with noise and the time painted into their pictures; panorama_node
stitches them and viewer_node serves them to Chromium, which is at the other end of a link. The
time is read back from what the page has drawn, from screenshots and from a subscriber.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from contextlib import nullcontext
from math import radians
from pathlib import Path

import numpy as np
from network import FOV_DEG, OFFSET_PX, SIZE, Ages
from slow_link import ROBOT, LinkQuality, SlowLink

from fisheye_capture.synthetic import synthetic_lens
from fisheye_testing.domains import unused_domain
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for

LINKS = {
    'loopback': None,
    **{
        f'{mbit_s}/{percent}': LinkQuality(mbit_s, 40.0, percent / 100)
        for mbit_s in (8, 2)
        for percent in (0, 1, 5)
    },
}
FORMATS = 'h264', 'jpeg'
STAGES = 'capture', 'pair', 'compose', 'JPEG', 'hop', 'encode', 'link', 'decode', 'draw'
TIMED = {
    **dict.fromkeys(('capture', 'paired', 'compose', 'publish'), 'panorama'),
    **dict.fromkeys(('arrived', 'encode'), 'viewer'),
}
"""What each node notes of each picture."""
RATE_HZ = 30.0
_HERE = Path(__file__).parent
_START_S = 90.0
_CUT_S, _RECOVERY_S = 5.0, 8.0
_FREEZE_MS = 150.0
"""A gap between pictures freezes if it is longer than three usual ones, or than a usual one by
this much (W3C, Identifiers for WebRTC's Statistics API, freezeCount)."""


def main() -> None:
    """Print a row of the table for each link and format."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--seconds', type=float, default=30.0, help='of each measurement')
    parser.add_argument('--links', nargs='*', default=list(LINKS), choices=list(LINKS))
    parser.add_argument('--formats', nargs='*', default=FORMATS, choices=FORMATS)
    parser.add_argument('--cut', action='store_true', help='then cut each link for 5 s')
    parser.add_argument('--watch', type=int, metavar='DOMAIN', help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.watch is not None:
        watch(arguments.watch, arguments.seconds)
        return
    columns = 'pictures/s', 'kbit/s', 'delay p50, p99', 'frozen s/min', *STAGES, 'screenshot'
    columns += 'page tells', 'subscriber p50, p99', 'back after a cut, s', 'then oldest'
    print(f'| link | format | {" | ".join(columns)} |')
    print('| --- ' * (2 + len(columns)) + '|')
    for name in arguments.links:
        for kind in arguments.formats:
            cells = measure(LINKS[name], kind, arguments.seconds, arguments.cut)
            print(f'| {LINKS[name] or name} | {kind} | {" | ".join(cells)} |', flush=True)


def measure(quality: LinkQuality | None, kind: str, seconds: float, has_cut: bool) -> list[str]:
    """Return the cells of a row."""
    domain = unused_domain()
    has_cut = has_cut and quality is not None
    with (
        tempfile.TemporaryDirectory() as folder,
        SlowLink(quality) if quality else nullcontext() as link,
        RigProcesses(domain, Path(folder, 'log'), {'ROS_HOME': folder}) as rig,
    ):
        at_robot, at_base = (link.robot.prefix, link.base.prefix) if link else ((), ())
        start(rig, at_robot, is_far=link is not None)
        url = rig.page_url(_START_S)
        watched = [*at_robot, sys.executable, __file__, '--watch', str(domain)]
        told = subprocess.run([*watched, '--seconds', str(seconds / 3)], stdout=subprocess.PIPE)
        subscriber = json.loads(told.stdout)
        before = {stage: len(times(rig, stage)) for stage in TIMED}
        length_s = seconds + has_cut * (_CUT_S + _RECOVERY_S)
        places = json.dumps(subscriber['places'])
        program = [*at_base, sys.executable, str(_HERE / 'delay_page.py')]
        with subprocess.Popen(
            [*program, url, str(length_s), kind, places], stdout=subprocess.PIPE, text=True
        ) as page:
            print(page.stdout.readline().strip(), file=sys.stderr)
            end_ms = 1e3 * (time.time() + seconds)
            time.sleep(seconds)
            timed = {stage: times(rig, stage)[before[stage] :] for stage in TIMED}
            mended_ms = cut(link) if has_cut else None
            seen = json.loads(page.stdout.readline())
        rig.check_alive()
    return cells_of(seen, timed, subscriber['ages'], end_ms, mended_ms)


def start(rig: RigProcesses, prefix: tuple[str, ...], *, is_far: bool) -> None:
    """Start the robot's nodes."""
    for node, parameters in (
        ('panorama', {'offset_x_px': f'[{OFFSET_PX}]', 'frame_rate_hz': RATE_HZ}),
        ('viewer', {'host': ROBOT, 'https': True, 'public': True} if is_far else {}),
    ):
        words = [f'{name}:={value}' for name, value in {**parameters, 'port': 8083}.items()]
        command = [*prefix, sys.executable, str(_HERE / 'timed_node.py'), node]
        options = [part for word in words for part in ('-p', word)]
        rig.run(node, [*command, str(stage_file(rig, node)), '--ros-args', *options])


def stage_file(rig: RigProcesses, node: str) -> Path:
    """Return where a node notes its times."""
    return rig.log(node).with_suffix('.times')


def times(rig: RigProcesses, stage: str) -> list[float]:
    """Return the times of a stage so far, ms."""
    lines = stage_file(rig, TIMED[stage]).read_text().splitlines()
    pairs = [line.split() for line in lines]
    return [float(pair[1]) for pair in pairs if len(pair) == 2 and pair[0] == stage]


def cut(link: SlowLink) -> float:
    """Cut a link for a while; return when it was mended, ms since the epoch."""
    link.cut()
    time.sleep(_CUT_S)
    link.mend()
    return 1e3 * time.time()


def watch(domain: int, seconds: float) -> None:
    """Print the ages of what a subscriber sees, and where the time is painted."""
    with Ages(domain, synthetic_lens(*SIZE, radians(FOV_DEG))) as ages:
        wait_for(lambda: len(ages.true_ms) > RATE_HZ, _START_S, 'panoramas')
        ages.restart()
        time.sleep(seconds)
        print(json.dumps({'ages': ages.true_ms, 'places': ages.places}))


def cells_of(seen, timed, subscriber, end_ms, mended_ms) -> list[str]:
    """Return the cells of a row; times in ms where nothing else is said."""
    pictures = [each for each in seen['pictures'] if each['painted'] and each['drawn'] < end_ms]
    ages, drawn, received, decoded = (
        np.array([each[later] - each[earlier] for each in pictures])
        for later, earlier in (
            ('drawn', 'painted'),
            ('drawn', 'decoded'),
            ('received', 'painted'),
            ('decoded', 'received'),
        )
    )
    moments = np.array([each['drawn'] for each in pictures])
    gaps, seconds = np.diff(moments), np.ptp(moments) / 1e3
    frozen = gaps[gaps > max(3 * gaps.mean(), gaps.mean() + _FREEZE_MS)].sum() / 1e3
    kbit_s = sum(each['bytes'] for each in pictures) * 8 / 1e3 / seconds
    usual = {stage: np.median(values) if values else 0.0 for stage, values in timed.items()}
    published = usual['paired'] + usual['compose'] + usual['publish']
    stages = (
        usual['capture'],
        usual['paired'] - usual['capture'],
        usual['compose'],
        usual['publish'],
        usual['arrived'] - published,
        usual['encode'],
        np.median(received) - usual['arrived'] - usual['encode'],
        np.median(decoded),
        np.median(drawn),
    )
    back, oldest = recovery(seen['pictures'], mended_ms)
    return [
        f'{len(pictures) / seconds:.1f}',
        f'{kbit_s:.0f}',
        spread(ages),
        f'{frozen * 60 / seconds:.1f}',
        *(f'{stage:.0f}' for stage in stages),
        f'{np.median(seen["shots"] or [np.nan]):.0f}',
        seen['told'][-1] if mended_ms is None else seen['told'][0],
        spread(subscriber),
        back,
        oldest,
    ]


def recovery(pictures, mended_ms) -> tuple[str, str]:
    """Return when the first picture was drawn after a cut, s, and the oldest one since, ms."""
    after = [each for each in pictures if mended_ms and each['drawn'] > mended_ms]
    ages = [each['drawn'] - each['painted'] for each in after if each['painted']]
    if not ages:
        return '-', '-' if mended_ms is None else 'none'
    return f'{(after[0]["drawn"] - mended_ms) / 1e3:.2f}', f'{max(ages):.0f}'


def spread(values) -> str:
    """Return median and 99th percentile."""
    return ', '.join(f'{value:.0f}' for value in np.percentile(values, (50, 99)))


if __name__ == '__main__':
    main()
