"""What the overlap is measured on: real rigs, random ones, and pairs without a common scene."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, permutations
from pathlib import Path

import cv2
import numpy as np
from rigs import random_rig
from scipy.spatial.transform import Rotation

from fisheye_geometry.camera_file import read_camera
from fisheye_testing.data import DATA
from panorama_stitch.overlap.view import OverlapView

WIDE_DEG, FAR_SHARE = 15.0, 1 / 3
"""Rigs on which the rotation must be found: so much overlap, and so much of it far."""


@dataclass(frozen=True)
class Case:
    """A pair of views; `rotation` is None where there is no truth."""

    group: str
    name: str
    left: OverlapView
    right: OverlapView
    rotation: Rotation | None
    common: bool = True


def cases(seed: int, rigs: int, apart: int) -> Iterator[Case]:
    """Return the real rigs, `rigs` random ones, and `apart` pairs without a common scene."""
    yield from _field()
    yield from _real()
    for i in range(rigs):
        yield _random(seed + i, common=True)
    for i in range(apart):
        yield _random(seed + i, common=False)


def _field() -> Iterator[Case]:
    for path in sorted((DATA / 'field').glob('*/truth.json')):
        truth = json.loads(path.read_text())
        cameras = truth['cameras']
        attitudes = {
            name: Rotation.from_matrix(np.reshape(rows, (3, 3)))
            for name, rows in truth['attitude'].items()
        }
        neighbours = list(pairwise(cameras))
        if truth['closed'] and len(cameras) > 2:
            neighbours.append((cameras[-1], cameras[0]))
        for left, right in neighbours:
            views = [_view(path.parent, camera) for camera in (left, right)]
            rotation = attitudes[left].inv() * attitudes[right]
            yield Case('field', f'{path.parent.name} {left} {right}', *views, rotation)


def _real() -> Iterator[Case]:
    """Pairs of real pictures, and what the left and right views of two places make."""
    views = {}
    for path in sorted((DATA / 'rigs').glob('*/truth.json')):
        truth, name = json.loads(path.read_text()), path.parent.name
        left, right = (_view(path.parent, side) for side in ('left', 'right'))
        if not truth['overlaps']:
            yield Case('real apart', name, left, right, None, common=False)
            continue
        rotation = None
        if truth['offset_deg']:
            views[name] = left, right
            angles = truth['offset_deg'], truth['pitch_deg'], truth['roll_deg']
            rotation = Rotation.from_euler('YXZ', angles, degrees=True)
        yield Case('rigs', name, left, right, rotation)
    for one, other in permutations(views, 2):
        pair = views[one][0], views[other][1]
        yield Case('real apart', f'{one} and {other}', *pair, None, common=False)


def _view(folder: Path, camera: str) -> OverlapView:
    image = cv2.imread(str(folder / f'{camera}.png'), cv2.IMREAD_GRAYSCALE)
    return OverlapView(image, read_camera(folder / f'{camera}.yaml').lens)


def _random(seed: int, *, common: bool) -> Case:
    rig = random_rig(seed, common=common, held_out=True)
    able = rig.overlap_deg >= WIDE_DEG and rig.far_share >= FAR_SHARE
    kind = 'near' if rig.about['near'] or rig.about['body'] else 'distant'
    group = 'apart' if not common else f'wide, {kind}' if able else f'narrow, {kind}'
    views = (OverlapView(rig.left, rig.lenses[0]), OverlapView(rig.right, rig.lenses[1]))
    return Case(group, rig.name, *views, rig.rotation if common else None, common)
