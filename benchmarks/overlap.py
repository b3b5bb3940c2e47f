"""How well the overlap of two views is found: right, wrong, missed and false, for each method.

The rigs are real pictures with a known truth, random ones (see rigs.py), and pairs that share no
scene: random ones, and left and right views of different real places. An answer is right within
half a degree. The time is that of one measurement, in ms and as a multiple of one
`cv2.matchTemplate` of the same facing halves over all offsets, on one core.
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from math import degrees, nan, radians
from pathlib import Path

import cv2
import numpy as np
from overlap_cases import Case, cases
from overlap_picture import draw

from panorama_stitch.overlap.measure_overlap import (
    METHODS,
    Overlap,
    OverlapSettings,
    measure_overlap,
)
from panorama_stitch.overlap.particles import facing_halves

FIRST_SEED = 5000
RIGHT_DEG, RIG_DEG, SHARE = 0.5, 0.35, 0.99
TIMES = 4.0
"""At most so many times one matchTemplate."""
RISE_PX = 20
PICTURES = 20
"""So many of each group are drawn."""


@dataclass(frozen=True)
class CaseResult:
    """What one method said of one case; NaN where there is nothing to compare with."""

    group: str
    name: str
    method: str
    decided: str
    expected: bool
    found: bool
    offset_deg: float
    error_px: float
    error_deg: float
    confidence: float
    ms: float
    times: float
    message: str


def main() -> int:
    """Print the table and write out/overlap.json; 1 if `particles` misses a target."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    parser.add_argument('--pictures', type=Path, help='draw what was found into this folder')
    parser.add_argument('--quick', action='store_true', help='a tenth of the random rigs')
    parser.add_argument('--seed', type=int, default=FIRST_SEED, help='of the first random rig')
    options = parser.parse_args()
    cv2.setNumThreads(1)
    count = 10 if options.quick else 100
    results, drawn = [], {}
    for case in cases(options.seed, count):
        template_ms = min(_timed(_match_template, case)[1] for _ in range(2))
        for method in METHODS:
            overlap, ms = _timed(_measure, case, method)
            results.append(_compare(case, method, overlap, ms, ms / template_ms))
            drawn[case.group] = drawn.get(case.group, 0) + 1
            if options.pictures and drawn[case.group] <= len(METHODS) * PICTURES:
                options.pictures.mkdir(parents=True, exist_ok=True)
                path = options.pictures / f'{case.group} {case.name} {method}.jpg'.replace(
                    ' ', '_'
                )
                cv2.imwrite(str(path), draw(case.pictures, case.surfaces, overlap))
    options.out.mkdir(parents=True, exist_ok=True)
    report = [asdict(result) for result in results]
    (options.out / 'overlap.json').write_text(json.dumps(report, indent=1))
    _print_table(results)
    complaints = list(_complaints(results))
    print(*complaints, sep='\n')
    return 1 if complaints else 0


def _measure(case: Case, method: str) -> Overlap:
    return measure_overlap([case.pictures], *case.surfaces, OverlapSettings(), method)


def _match_template(case: Case) -> None:
    left, right = facing_halves(*case.pictures)
    rows = max(RISE_PX, right.shape[0] - left.shape[0])
    edges = rows, rows, right.shape[1], right.shape[1]
    cv2.matchTemplate(
        cv2.copyMakeBorder(left, *edges, cv2.BORDER_CONSTANT), right, cv2.TM_CCOEFF_NORMED
    )


def _timed(function, *arguments):
    """Return a result and the processor time it took, ms; other programs do not count."""
    start = time.process_time()
    result = function(*arguments)
    return result, (time.process_time() - start) * 1e3


def _compare(case: Case, method: str, overlap: Overlap, ms: float, times: float) -> CaseResult:
    left, right = case.surfaces
    error_px = error_deg = nan
    level = left.center_x_px - right.center_x_px
    if case.offset_deg is not None and overlap.found:
        error_px = overlap.offset_x_px - level - left.focal_px * radians(case.offset_deg)
        error_deg = degrees(error_px / left.focal_px)
    return CaseResult(
        group=case.group,
        name=case.name,
        method=method,
        decided=overlap.method,
        expected=case.overlaps,
        found=overlap.found,
        offset_deg=degrees((overlap.offset_x_px - level) / left.focal_px),
        error_px=error_px,
        error_deg=error_deg,
        confidence=overlap.confidence,
        ms=ms,
        times=times,
        message=overlap.message,
    )


def _print_table(results: list[CaseResult]) -> None:
    print(
        'method      rigs         number  in 1 px  in 0.5 deg  worst deg  missed  false'
        '      ms  times matchTemplate'
    )
    for method in METHODS:
        for group in dict.fromkeys(result.group for result in results):
            of = [r for r in results if (r.method, r.group) == (method, group)]
            known = [r for r in of if r.error_deg == r.error_deg or (not r.found and r.expected)]
            errors = np.array([r.error_deg for r in known if r.found])
            shares = [
                f'{np.mean([r.found and abs(getattr(r, key)) <= most for r in known]):8.1%}'
                if known and of[0].expected
                else '       -'
                for key, most in (('error_px', 1.0), ('error_deg', RIGHT_DEG))
            ]
            worst = (
                f'{np.abs(errors).max():9.2f}' if len(errors) and of[0].expected else '        -'
            )
            print(
                f'{method:11} {group:11} {len(of):7} {shares[0]}  {shares[1]:>10}  {worst}  '
                f'{sum(r.expected and not r.found for r in of):6}  '
                f'{sum(r.found and not r.expected for r in of):5}  '
                f'{np.median([r.ms for r in of]):6.1f}  {np.median([r.times for r in of]):6.2f}'
            )


def _complaints(results: list[CaseResult]) -> Iterator[str]:
    """Yield the targets that `particles` misses."""
    mine = [r for r in results if r.method == 'particles']
    wide = [r for r in mine if r.group == 'random']
    right = np.mean([r.found and abs(r.error_deg) <= RIGHT_DEG for r in wide])
    if right < SHARE:
        yield f'{right:.1%} of the random rigs are right; {SHARE:.0%} are asked'
    for r in mine:
        if r.group == 'real apart' and r.found:
            yield f'{r.name} have no common scene; found {r.offset_deg:.2f} degrees'
        if r.group == 'real' and not (r.found and not abs(r.error_deg) > RIG_DEG):
            yield f'{r.name} is off by {r.error_deg:.2f} degrees; {RIG_DEG} are allowed'
    shun = [r for r in mine if r.name.startswith('shun74')]
    middle = np.median([r.offset_deg for r in shun]) if shun else nan
    for r in shun:
        if abs(r.offset_deg - middle) > RIGHT_DEG:
            yield f'{r.name} is {r.offset_deg - middle:.2f} degrees from the median of its rig'
    times = np.median([r.times for r in mine])
    if times > TIMES:
        yield f'particles take {times:.1f} times one matchTemplate; {TIMES:g} are allowed'


if __name__ == '__main__':
    sys.exit(main())
