"""Free-running cameras paired by their stamps: rate, worst gap and skew.

Each line is the worst of ten phases and of two draws of the jitter (evenly distributed), over 20 s
each; frames are those of the slowest camera. Prints the table of docs/stitch.md.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from fisheye_testing.free_running import CameraTiming, Paired, pair_frames
from panorama_stitch.pipeline.pairing import FramePairing

PHASES = (0.0, 0.1, 0.25, 0.4, 0.45, 0.5, 0.55, 0.6, 0.75, 0.9)
"""Of the period of the second camera, behind the first."""
SEEDS = (0, 1)
JITTERS_MS = (0, 1, 2, 4, 8, 16)


def cases() -> Iterator[tuple[str, Sequence[CameraTiming]]]:
    """Yield each case with a name; the phases are added later."""
    for rate in (10, 15, 30, 60):
        for jitter in JITTERS_MS:
            yield f'{rate} and {rate} Hz, jitter {jitter} ms', [CameraTiming(rate, 0, jitter)] * 2
    for rates in ((30, 29.83), (30, 25), (60, 30), (60, 10)):
        for jitter in (0, 4):
            cameras = [CameraTiming(rate, 0, jitter) for rate in rates]
            yield f'{rates[0]:g} and {rates[1]:g} Hz, jitter {jitter} ms', cameras
    for lost in (0.01, 0.05):
        yield f'30 and 30 Hz, {lost:.0%} lost of each', [CameraTiming(30, 0, 1, lost)] * 2
    for late in (50, 200):
        yield (
            f'30 and 30 Hz, one {late} ms late',
            [CameraTiming(30, 0, 1), CameraTiming(30, 0, 1, late_ms=late)],
        )
    for rates in ((30, 30, 30), (30, 29.83, 25)):
        cameras = [CameraTiming(rate, 0, 1) for rate in rates]
        yield ', '.join(f'{rate:g}' for rate in rates) + ' Hz, jitter 1 ms', cameras


def measure(cameras: Sequence[CameraTiming]) -> list[Paired]:
    """Pair at each phase; a third camera lies half as far behind."""
    results = []
    for phase in PHASES:
        shifted = [
            replace(camera, phase_ms=phase * 1000 / camera.rate_hz / max(index, 1) * (index > 0))
            for index, camera in enumerate(cameras)
        ]
        results += [pair_frames(FramePairing, shifted, seed=seed) for seed in SEEDS]
    return results


def main() -> None:
    """Print the table."""
    print('| cameras | panoramas for each frame | longest gap, periods | skew, ms | worst, ms |')
    print('| --- | --- | --- | --- | --- |')
    for name, cameras in cases():
        results = measure(cameras)
        share = min(result.share for result in results)
        gap = max(result.gap_periods for result in results)
        skew = max(result.skew_ms for result in results)
        worst = max(result.worst_skew_ms for result in results)
        print(f'| {name} | {share:.3f} | {gap:.2f} | {skew:.1f} | {worst:.1f} |')


if __name__ == '__main__':
    main()
