"""How well the rotation between two cameras is found, and what its confidence is worth.

The rigs are real pictures with a known truth, random ones with things near, bodies and tilt (see
rigs.py), and pairs that share no scene. An answer is right within half a degree. Times are of one
measurement on one core.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from overlap_cases import Case, cases

from panorama_stitch.overlap.measure import MIN_CONFIDENCE, measure_rotation

FIRST_SEED = 30060
RIGHT_DEG, WRONG_DEG, SURE = 0.5, 1.0, 0.8
SHARE, FALSE_SHARE = 0.97, 0.005


@dataclass(frozen=True)
class Result:
    """What was measured of one case; the error is NaN where there is no truth."""

    group: str
    name: str
    common: bool
    found: bool
    error_deg: float
    confidence: float
    limit: str
    ms: float
    evidence: dict = field(default_factory=dict)

    @property
    def is_right(self) -> bool:
        """Whether it is within half a degree; False where there is no truth."""
        return self.error_deg <= RIGHT_DEG


def main() -> int:
    """Print the table, write out/overlap.jsonl and the curve; 1 where a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    parser.add_argument('--quick', action='store_true', help='a tenth of the random rigs')
    parser.add_argument('--seed', type=int, default=FIRST_SEED, help='of the first random rig')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    rigs, apart = (60, 20) if options.quick else (600, 200)
    options.out.mkdir(parents=True, exist_ok=True)
    results = []
    with (options.out / 'overlap.jsonl').open('w') as lines:
        for case in cases(options.seed, rigs, apart):
            results.append(measured(case))
            lines.write(json.dumps(asdict(results[-1])) + '\n')
            lines.flush()
    return report(results, options.out)


def report(results: list[Result], out: Path) -> int:
    """Print the table and what is missed, and draw the curve."""
    _print_table(results)
    draw_curve(results, out / 'overlap_confidence.png')
    complaints = list(_complaints(results))
    print(*complaints, sep='\n')
    return 1 if complaints else 0


def measured(case: Case) -> Result:
    """Measure one case."""
    start = time.process_time()
    result = measure_rotation([(case.left, case.right)])
    ms = (time.process_time() - start) * 1e3
    error = np.nan
    if case.rotation is not None:
        error = 180.0
        if result.rotation is not None:
            error = np.degrees((case.rotation.inv() * result.rotation).magnitude())
    return Result(
        group=case.group,
        name=case.name,
        common=case.common,
        found=result.found,
        error_deg=float(error),
        confidence=result.confidence,
        limit=result.limit,
        ms=ms,
        evidence=asdict(result.evidence) if result.evidence else {},
    )


def _print_table(results):
    print(
        'rigs             number  right  right and found  found wrong  sure and wrong  median ms'
    )
    for group in dict.fromkeys(result.group for result in results):
        of = [r for r in results if r.group == group]
        known = [r for r in of if r.error_deg == r.error_deg]
        right = f'{np.mean([r.is_right for r in known]):6.1%}' if known else '     -'
        both = f'{np.mean([r.is_right and r.found for r in known]):6.1%}' if known else '     -'
        wrong = sum(r.found and not r.is_right for r in known) + sum(
            r.found and not r.common for r in of
        )
        sure = sum(r.confidence >= SURE and r.error_deg > WRONG_DEG for r in known)
        ms = np.median([r.ms for r in of])
        print(f'{group:15} {len(of):7} {right}  {both:>15} {wrong:12} {sure:15} {ms:10.0f}')


def _complaints(results) -> Iterator[str]:
    able = [r for r in results if r.group.startswith('wide')]
    right = np.mean([r.is_right for r in able])
    if right < SHARE:
        yield f'{right:.1%} of the wide random rigs are right; {SHARE:.0%} are asked'
    for r in results:
        if r.confidence >= SURE and r.error_deg > WRONG_DEG:
            yield f'{r.name} is off by {r.error_deg:.1f} degrees at {r.confidence:.2f}'
        if r.group == 'field' and not (r.is_right and r.found):
            yield f'{r.name} is off by {r.error_deg:.2f} degrees at {r.confidence:.2f}'
        if r.group == 'real apart' and r.found:
            yield f'{r.name} have no common scene; found at {r.confidence:.2f}'
    apart = [r for r in results if r.group == 'apart']
    found = sum(r.found for r in apart)
    if found > FALSE_SHARE * len(apart):
        yield f'{found} of {len(apart)} random pairs without a common scene are found'


def draw_curve(results: list[Result], path: Path) -> None:
    """Draw how many of the answers of one confidence are right."""
    import matplotlib

    matplotlib.use('Agg')
    from matplotlib import pyplot

    random = [r for r in results if r.group.startswith(('wide', 'narrow'))]
    random += [r for r in results if r.group == 'apart']
    told = np.array([r.confidence for r in random])
    right = np.array([r.is_right for r in random], float)
    edges = np.array([0, 0.2, 0.4, 0.6, 0.8, 0.9, 0.95, 1.001])
    figure, axes = pyplot.subplots(figsize=(5, 4.5))
    axes.plot([0, 1], [0, 1], color='0.7', linewidth=1)
    for low, high in pairwise(edges):
        inside = (told >= low) & (told < high)
        if not inside.any():
            continue
        count, share = int(inside.sum()), right[inside].mean()
        deviation = np.sqrt((share * count + 1) * (count - share * count + 1) / (count + 2) ** 3)
        axes.errorbar(told[inside].mean(), share, deviation, fmt='o', color='C0', capsize=3)
        axes.annotate(f' {count}', (told[inside].mean(), share), va='top')
    axes.axvline(MIN_CONFIDENCE, color='C1', linestyle=':')
    axes.set(xlabel='confidence', ylabel='share within 0.5 degrees', xlim=(0, 1), ylim=(0, 1.02))
    figure.tight_layout()
    figure.savefig(path, dpi=110)
    pyplot.close(figure)


if __name__ == '__main__':
    sys.exit(main())
