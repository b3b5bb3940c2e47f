"""Panoramas of the rigs in the field, checked and written.

They are drawn from their true rotations, or from those that their pictures tell.

At each seam both neighbours are drawn alone, and the displacement of the one against the other is
measured by optical flow where there is texture: the median, and what nine tenths stay below, in
degrees (near things are displaced by their parallax, whatever the attitudes). The horizon is how
far the level frame that follows from the rig's own symmetry leans against the world.
"""

import argparse
import json
import sys
from dataclasses import dataclass
from itertools import pairwise
from math import degrees
from pathlib import Path

import cv2
import numpy as np
from pairs import read_view
from scipy.spatial.transform import Rotation

from fisheye_core.errors import FisheyeError
from fisheye_geometry.attitude import angle_between
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.level import DOWN
from fisheye_geometry.rig import Rig, pairs_of
from fisheye_geometry.rig_solution import solve_rig
from fisheye_geometry.surface import SURFACES
from fisheye_testing.data import DATA
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.layout import covered
from panorama_stitch.compose.placing import leads_around, place
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.view import OverlapView

AROUND_SEAM_DEG = 8.0
TEXTURE = 12.0
"""Gradient, grey levels a pixel, from which on flow can be believed."""
ATTITUDE_LIMIT_DEG, SEAM_LIMIT_DEG, HORIZON_LIMIT_DEG = 0.5, 0.5, 1.0
MIN_CONFIDENCE = 0.5
WAY_BACK_DEG = 10.0
"""How far the last camera and the first may be from what the others make of them."""
SYMMETRIC = ('tilt_down_5', 'tilt_down_12', 'mixed_lenses', 'ring_3', 'six_conventional')
"""Rigs whose cameras pitch and roll alike."""
NEAR = ('post', 'mast', 'body')
"""Beginnings of names of rigs with something near, whose parallax no attitude can take away."""


@dataclass(frozen=True)
class FieldRig:
    """A rig with its pictures, lenses and true attitudes (3, 3)."""

    name: str
    images: list
    lenses: list
    attitudes: list
    is_closed: bool


@dataclass(frozen=True)
class Checked:
    """What is right with a panorama; degrees."""

    name: str
    attitude_deg: float
    width_deg: float
    seam_deg: float
    seam_worst_deg: float
    horizon_deg: float
    black_percent: float

    @property
    def faults(self) -> list[str]:
        """What misses its limit."""
        checks = {
            f'attitude {self.attitude_deg:.2f} deg': self.attitude_deg > ATTITUDE_LIMIT_DEG,
            f'seam {self.seam_deg:.2f} deg': self.seam_deg > SEAM_LIMIT_DEG
            and not self.name.startswith(NEAR),
            f'horizon {self.horizon_deg:.2f} deg': self.name in SYMMETRIC
            and self.horizon_deg > HORIZON_LIMIT_DEG,
            f'{self.width_deg:.2f} deg wide': self.width_deg > 360 + 1e-6,
            f'{self.black_percent:.3f} % black': self.black_percent > 0,
        }
        return [what for what, is_fault in checks.items() if is_fault]


def main() -> int:
    """Print a row for each rig; 1 if one misses a limit."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--out', type=Path, default=Path('out/panoramas'), help='for pictures')
    parser.add_argument('--surface', choices=SURFACES[:2], default=SURFACES[0])
    parser.add_argument('--measured', action='store_true', help='from pictures, not from truth')
    parser.add_argument('names', nargs='*', help='rigs; all by default')
    options = parser.parse_args()
    folders = sorted(path.parent for path in (DATA / 'field').glob('*/truth.json'))
    if not folders:
        sys.exit('No rigs are there; set FISHEYE_DATA to the folder that holds field/.')
    options.out.mkdir(parents=True, exist_ok=True)
    print('rig                attitude   width   seam  worst  horizon  black   faults')
    results = []
    for folder in folders:
        if options.names and folder.name not in options.names:
            continue
        checked = check(read_rig(folder), options)
        results.append(checked)
        print(
            f'{checked.name:17s} {checked.attitude_deg:9.2f} {checked.width_deg:7.2f} '
            f'{checked.seam_deg:6.2f} {checked.seam_worst_deg:6.2f} {checked.horizon_deg:8.2f} '
            f'{checked.black_percent:6.3f}   {", ".join(checked.faults) or "-"}',
            flush=True,
        )
    return int(any(result.faults for result in results))


def read_rig(folder: Path) -> FieldRig:
    """Read pictures, calibrations and truth."""
    truth = json.loads((folder / 'truth.json').read_text())
    views = [read_view(folder, name) for name in truth['cameras']]
    lenses, images = (list(each) for each in zip(*views, strict=True))
    attitudes = [np.reshape(truth['attitude'][name], (3, 3)) for name in truth['cameras']]
    return FieldRig(folder.name, images, lenses, attitudes, truth['closed'])


def solve_true(rig: FieldRig) -> Rig:
    """Solve a rig from its true rotations; what level is has to follow from them."""
    relative = [left.T @ right for left, right in pairwise(rig.attitudes)]
    closing = rig.attitudes[-1].T @ rig.attitudes[0] if rig.is_closed else None
    return solve_rig(named(rig), relative, closing=closing).rig


def solve_measured(rig: FieldRig, surfaces) -> Rig:
    """Solve a rig from its pictures alone: neighbours, then the way back if it leads around."""
    views = [OverlapView(*each) for each in zip(rig.images, rig.lenses, strict=True)]
    rotations = [measured(left, right) for left, right in pairwise(views)]
    solved = solve_rig(named(rig), rotations).rig
    if not leads_around(views_of_rig(solved, surfaces)):
        return solved
    last, first = (solved.cameras[index].attitude.matrix for index in (-1, 0))
    closing = measured(views[-1], views[0], Rotation.from_matrix(last.T @ first))
    return solve_rig(named(rig), rotations, closing=closing).rig


def measured(left: OverlapView, right: OverlapView, expected: Rotation | None = None):
    """Return the rotation between two cameras, (3, 3), or None."""
    within_rad = np.pi if expected is None else np.radians(WAY_BACK_DEG)
    result = measure_rotation([(left, right)], expected=expected, within_rad=within_rad)
    return result.rotation.as_matrix() if result.found else None


def named(rig: FieldRig) -> list:
    """Return pairs of a name and a lens."""
    return [(f'camera {index}', lens) for index, lens in enumerate(rig.lenses)]


def check(rig: FieldRig, options) -> Checked:
    """Draw a rig's panorama, write it, and measure it."""
    surfaces = [surface_for(lens, options.surface) for lens in rig.lenses]
    surfaces = [surface.with_focal(surfaces[0].focal_px) for surface in surfaces]
    solved = solve_measured(rig, surfaces) if options.measured else solve_true(rig)
    level = [camera.attitude.matrix for camera in solved.cameras]
    views, wraps = views_of_rig(solved, surfaces), solved.is_closed
    turned = [
        angle_between(level[left].T @ level[right], rig.attitudes[left].T @ rig.attitudes[right])
        for left, right in pairs_of(len(level))
    ]
    compositor = build_compositor(views, rig.images, Style(), wraps=wraps)
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(rig.images, out)
    cv2.imwrite(str(options.out / f'{rig.name}.png'), out)
    seams = range(len(compositor.layout.seams))
    at_seams = [displacement_deg(compositor, rig.images, k) for k in seams]
    shown = covered(compositor.layout, place(views, wraps=wraps))
    true_down, down = (a.T @ DOWN for a in (rig.attitudes[0], level[0]))
    return Checked(
        rig.name,
        degrees(max(turned)),
        degrees(surface.width / surface.focal_px),
        max(median for median, _ in at_seams),
        max(most for _, most in at_seams),
        degrees(np.arccos(np.clip(true_down @ down, -1, 1))),
        100 * float((~shown).mean()),
    )


def displacement_deg(compositor: Compositor, images, index: int) -> tuple[float, float]:
    """How far the right view lies beside the left one around a seam, deg: median and most."""
    layout, surface = compositor.layout, compositor.layout.surface
    px_per_deg = np.radians(surface.focal_px)
    half = round(AROUND_SEAM_DEG / 2 * px_per_deg)
    middle = sum(layout.seams[index]) // 2
    window = surface.window(middle - half, 0, 2 * half, surface.height)
    left, right = layout.order[index], layout.order[(index + 1) % len(layout.order)]
    pictures, seen = [], np.ones((surface.height, 2 * half), bool)
    for camera in (left, right):
        table = compositor.views[camera].drawn_on(window)
        drawn = cv2.cvtColor(table(images[camera]), cv2.COLOR_BGR2GRAY)
        pictures.append(cv2.GaussianBlur(drawn, (0, 0), 1.0))
        seen &= table.valid
    seen = cv2.erode(seen.astype(np.uint8), np.ones((9, 9), np.uint8), borderValue=0) > 0
    flow = cv2.DISOpticalFlow_create(cv2.DISOPTICAL_FLOW_PRESET_MEDIUM).calc(*pictures, None)
    slope = np.hypot(*(cv2.Sobel(pictures[0], cv2.CV_32F, *d) / 8 for d in ((1, 0), (0, 1))))
    believed = seen & (slope > TEXTURE)
    if believed.sum() < 50:
        believed = seen & (slope > np.quantile(slope[seen], 0.9)) if seen.any() else seen
    if not believed.any():
        return np.nan, np.nan
    lengths = np.hypot(flow[..., 0], flow[..., 1])[believed] / px_per_deg
    return float(np.median(lengths)), float(np.quantile(lengths, 0.9))


if __name__ == '__main__':
    try:
        sys.exit(main())
    except FisheyeError as error:
        sys.exit(f'The benchmark failed: {error}')
