"""The pairs of views on which overlap calibration is measured, and the truth about them."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations

import cv2
import numpy as np
from pairs import DATA, folder_pair, synthetic_pair
from rigs import random_rig

from fisheye_geometry.surface import Surface, surface_for
from panorama_stitch.compose.view import View

WIDE_DEG = 15.0
"""Overlaps at least this wide must be found."""


@dataclass(frozen=True)
class Case:
    """Two corrected pictures (height, width) uint8 and the truth; `offset_deg` None if unknown."""

    group: str
    name: str
    pictures: tuple[np.ndarray, np.ndarray]
    surfaces: tuple[Surface, Surface]
    offset_deg: float | None
    overlaps: bool


def cases(seed: int, count: int) -> Iterator[Case]:
    """Return the real rigs, then `count` times three random ones and `count` without overlap."""
    yield _synthetic()
    yield from _real()
    for i in range(3 * count):
        yield _random(seed + i, overlaps=True)
    for i in range(count):
        yield _random(seed + i, overlaps=False)


def _synthetic() -> Case:
    pair = synthetic_pair(640, 480)
    return _case('real', pair.name, pair.lenses, pair.images, 'cylindrical', 140.0, True)


def _real() -> Iterator[Case]:
    """Return the rigs of real pictures, and what the left and right views of two places make."""
    folders = [path.parent for path in sorted((DATA / 'rigs').glob('*/truth.json'))]
    if not folders:
        print('No rigs of real pictures are there; set FISHEYE_DATA to their folder.')
    pairs = {}
    for folder in folders:
        truth = json.loads((folder / 'truth.json').read_text())
        pair = folder_pair(folder)
        group = 'real' if truth['overlaps'] else 'real apart'
        yield _case(
            group,
            pair.name,
            pair.lenses,
            pair.images,
            'cylindrical',
            truth['offset_deg'],
            truth['overlaps'],
        )
        if truth['overlaps'] and truth['offset_deg']:
            pairs[pair.name] = pair
    for one, other in permutations(pairs, 2):
        left, right = pairs[one], pairs[other]
        yield _case(
            'real apart',
            f'{one} and {other}',
            (left.lenses[0], right.lenses[1]),
            (left.images[0], right.images[1]),
            'cylindrical',
            None,
            False,
        )


def _random(seed: int, overlaps: bool) -> Case:
    rig = random_rig(seed, overlaps)
    group = 'apart' if not overlaps else 'random' if rig.common_deg >= WIDE_DEG else 'narrow'
    lenses, pictures = (rig.left_lens, rig.right_lens), (rig.left, rig.right)
    return _case(group, rig.name, lenses, pictures, rig.surface, rig.offset_deg, overlaps)


def _case(group, name, lenses, pictures, kind, offset_deg, overlaps) -> Case:
    surfaces = [surface_for(lens, kind) for lens in lenses]
    surfaces[1] = surfaces[1].with_focal(surfaces[0].focal_px)
    corrected = []
    for lens, surface, picture in zip(lenses, surfaces, pictures, strict=True):
        grey = picture if picture.ndim == 2 else cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
        corrected.append(View(lens, surface).corrected(grey))
    return Case(group, name, tuple(corrected), tuple(surfaces), offset_deg, overlaps)
