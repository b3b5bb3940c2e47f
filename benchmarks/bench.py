"""Measure rates and delays, print tables, write out/bench.json.

Times are medians, with the tenth and the ninetieth percentile in brackets.
"""

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path

from compose import WAYS, Composing, composing_targets, measure_composing
from machine import describe_machine
from nodes import Run, measure_nodes, node_targets
from stages import Stage, measure_stages

from fisheye_core.errors import FisheyeError

PAPER_HZ = {'laptop': 11, 'embedded computer': 6}
"""Panoramas a second of two 640x480 cameras with nearest neighbours, as published."""
MARGIN = 1.3
"""How far a busy machine may miss a target before the short form fails."""


def main() -> int:
    """Run the benchmark; the short form gives 1 where a ratio is far from its target."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--short', action='store_true', help='only the ratios of composing')
    parser.add_argument('--seconds', type=float, default=20.0, help='how long each rig is watched')
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    arguments = parser.parse_args()
    machine = describe_machine()
    print('{processor}, {cores} cores, OpenCV {opencv}, load {load:.1f}'.format(**machine))
    arguments.out.mkdir(parents=True, exist_ok=True)
    composing = measure_composing(arguments.short)
    print_composing(composing)
    stages, runs = [], []
    if not arguments.short:
        stages = measure_stages()
        print_stages(stages)
        print_nodes_header()
        for run in measure_nodes(arguments.seconds, arguments.out / 'log'):
            print_run(run)
            runs.append(run)
    targets = composing_targets(composing) + node_targets(runs)
    print('', *targets, sep='\n')
    results = {
        'machine': machine,
        'composing': [asdict(result) for result in composing],
        'stages': [asdict(stage) for stage in stages],
        'nodes': [asdict(run) for run in runs],
        'paper_hz': PAPER_HZ,
    }
    (arguments.out / 'bench.json').write_text(json.dumps(results, indent=1))
    return int(arguments.short and max(target.excess for target in targets) > MARGIN)


def print_composing(results: list[Composing]) -> None:
    """Print times, and what they are in units of the floor and of one remap."""
    for result in results:
        print(
            f'\n{result.name}: {result.megapixels:.2f} Mpixel, '
            f'{result.ms_per_megapixel:.2f} ms per Mpixel with a feather'
        )
        for way in WAYS:
            print(
                f'  {way:14s} {result.times_ms[way]!s:24s} ms  {result.to_floor[way]:5.2f} floors'
                f'  {result.to_one_remap[way]:5.2f} remaps'
            )


def print_stages(stages: list[Stage]) -> None:
    """Print what a panorama costs from the cameras' bytes to those on the link."""
    print('\nFrom the cameras to the link, 640x480, one thread        CPU ms  Mbit/s at 30 Hz')
    for stage in stages:
        mbit_s = '' if stage.mbit_s is None else f'{stage.mbit_s:.2f}'
        print(f'  {stage.name:34s} {stage.cpu_ms!s:>24s} {mbit_s:>7s}')


def print_nodes_header() -> None:
    """Print what the columns of `print_run` are, and the published rates."""
    published = ', '.join(f'{hz} on a {what}' for what, hz in PAPER_HZ.items())
    print(f'\nPublished system: {published} panoramas a second.')
    print(
        'nodes                             Hz   p50   p95   p99 ms (calibrating)  lost missing '
        ' CPU ms   MiB  first s  calibration s  views Hz, p99 ms'
    )


def print_run(run: Run) -> None:
    """Print one row."""
    missing = '-' if run.missing is None else run.missing
    calibrating = '-' if run.calibrating_p99_ms is None else f'{run.calibrating_p99_ms:.1f}'
    views = '-' if run.view_hz is None else f'{run.view_hz:.1f}, {run.view_p99_ms:.1f}'
    print(
        f'{run.name:30s} {run.rate_hz:5.1f} {run.p50_ms:5.1f} {run.p95_ms:5.1f} {run.p99_ms:5.1f} '
        f'{calibrating:>16s} {run.lost:5d} {missing!s:>7s} {run.cpu_ms:7.1f} '
        f'{run.memory_mib:5.0f} {run.first_s:8.1f} {run.calibration_s:14.1f}  {views}',
        flush=True,
    )


if __name__ == '__main__':
    try:
        sys.exit(main())
    except (FisheyeError, RuntimeError, TimeoutError) as error:
        sys.exit(f'The benchmark failed: {error}')
    except KeyboardInterrupt:
        sys.exit(130)
