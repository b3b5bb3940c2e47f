"""Prints the table of docs/link.md: what each way across takes of the link and the machines."""

import tempfile
from pathlib import Path

import numpy as np
from known_rigs import synthetic_rig
from nodes import cpu_s, save_rig
from stages import Stage, measure_stages

from fisheye_testing.domains import unused_domain
from fisheye_testing.rig import RigProcesses
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

SLOW_MBIT_S = 8.0
RATE_HZ = 30.0
RAW_CAMERAS_MBIT_S = 2 * 640 * 480 * 3 * 8e-6 * RATE_HZ
_DECODE, _COMPOSE = 'decode the JPEGs of both cameras', 'compose'
_CAMERAS, _PANORAMA = 'encode both cameras as H.264', 'convert and encode as H.264'
WAYS = (
    ('two cameras, raw', None, [_DECODE], [_COMPOSE]),
    ('two cameras, their own JPEG', _DECODE, [], [_DECODE, _COMPOSE]),
    (
        'two cameras, H.264',
        _CAMERAS,
        [_DECODE, _CAMERAS],
        ['at the base: decode these', _COMPOSE],
    ),
    (
        'panorama, JPEG',
        'encode as JPEG',
        [_DECODE, _COMPOSE, 'encode as JPEG'],
        ['at the base: decode the JPEG'],
    ),
    (
        'panorama, H.264',
        _PANORAMA,
        [_DECODE, _COMPOSE, _PANORAMA],
        ['at the base: decode the H.264'],
    ),
)
"""Name, the stage whose output travels, and the stages on the robot and at the base."""


TRANSPORTS = ('raw', 'compressed', 'video')
START_S, COUNT = 60.0, 200


def main() -> None:
    """Print the table, then how old panoramas are that other nodes' cameras come to."""
    stages = {stage.name: stage for stage in measure_stages()}
    print('| what travels | Mbit/s | ms on 8 Mbit/s | CPU ms on the robot | at the base |')
    print('| --- | --- | --- | --- | --- |')
    for name, travelling, robot, base in WAYS:
        mbit_s = stages[travelling].mbit_s if travelling else RAW_CAMERAS_MBIT_S
        print(
            f'| {name} | {mbit_s:.1f} | {1e3 * mbit_s / RATE_HZ / SLOW_MBIT_S:.0f} '
            f'| {total_ms(stages, robot):.1f} | {total_ms(stages, base):.1f} |'
        )
    print('\ntransport   panorama, ms old   (p99)   CPU ms of both cameras   of the base')
    for transport in TRANSPORTS:
        print(run(transport), flush=True)


def run(transport: str) -> str:
    """Run both halves of a rig on one machine, on pictures held in memory; return a row."""
    domain = unused_domain()
    with (
        tempfile.TemporaryDirectory() as folder,
        Watcher(domain) as watcher,
        RigProcesses(domain, Path(folder) / 'log') as rig,
    ):
        cameras = save_rig(Path(folder), synthetic_rig('pair'), (640, 480)).cameras
        for name, values in cameras.items():
            rig.start(f'{name}/capture', frame_rate_hz=RATE_HZ, **values)
        rig.start(
            'panorama', transport=transport, **{f'{name}.source': 'topic' for name in cameras}
        )
        wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'an overlap')
        watcher.restart()
        before = used_ms(rig)
        wait_for(lambda: len(watcher.stamps_ns) >= COUNT, START_S, 'panoramas')
        robot_ms, base_ms = ((b - a) / COUNT for a, b in zip(before, used_ms(rig), strict=True))
        p50_ms, p99_ms = np.percentile(watcher.latencies_ms, (50, 99))
        return f'{transport:11s} {p50_ms:16.1f} {p99_ms:7.1f} {robot_ms:24.1f} {base_ms:13.1f}'


def used_ms(rig: RigProcesses) -> tuple[float, float]:
    """Return the processor time of the cameras' nodes and of the base, ms."""
    of = {node: 1e3 * cpu_s([process]) for node, process in rig.processes.items()}
    base_ms = of.pop('panorama')
    return sum(of.values()), base_ms


def total_ms(stages: dict[str, Stage], names: list[str]) -> float:
    """Return the processor time of some stages, ms."""
    return sum(stages[name].cpu_ms.median for name in names)


if __name__ == '__main__':
    main()
