"""How good panoramas look: truth, seam and flicker, for each blend and with gain on and off.

PSNR and SSIM compare with the truth where there is one, up to one common exposure. The step is
how much brighter than the left view the right one is beside the seam, after gain: the median of
patches, then the mean and the worst of all rows, grey levels. The edge is the sharpest change of
brightness from one column to the next that the scene does not show. The flicker is the standard
deviation of the seam's brightness over time, of a still scene with noise (and the bouncing ball).
Then posts and rooms with near things, as `posts` and `seams` say.
"""

import argparse
import json
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from pairs import YAWS, ImagePair, real_pairs, synthetic_pair
from posts import judge_posts
from seams import judge_seams
from similarity import similarity_map

from fisheye_capture.scene import Scene
from fisheye_core.errors import FisheyeError
from fisheye_geometry.attitude import Attitude
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

EXPOSURES = (1.0, 1.0), (1.0, 1.3)
FRAMES = 60
PERIOD_NS = 33_000_000
NOISE, NOISES = 2.0, 6
PATCH_ROWS, PATCH_DEG = 15, 2.0
STEP_LIMIT, FLICKER_LIMIT, LOSS_LIMIT_DB = 2.0, 0.5, 1.0


@dataclass(frozen=True)
class Quality:
    """What one way to compose gives; NaN where there is no truth. Levels are grey levels."""

    rig: str
    blend: str
    gain: bool
    psnr_db: float
    ssim: float
    step_mean: float
    step_worst: float
    edge: float
    flicker: float


def main() -> int:
    """Print the tables and write them to out/; 1 if a target is missed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--out', type=Path, default=Path('out'), help='where results go')
    out = parser.parse_args().out
    pairs = []
    for gains in EXPOSURES:
        pair = synthetic_pair(640, 480, gains)
        pairs.append((replace(pair, name='synthetic {} : {}'.format(*gains)), gains))
    real = real_pairs()
    if not real:
        print('No rigs of real pictures are there; set FISHEYE_DATA to their folder.')
    pairs += [(pair, None) for pair in real]
    print(f'{"rig":22s} {"blend":9s} gain   PSNR   SSIM  step mean  worst   edge  flicker')
    results = []
    for pair, gains in pairs:
        for quality in judged(pair, gains):
            results.append(quality)
            print(
                f'{quality.rig:22s} {quality.blend:9s} {"on" if quality.gain else "off":4s} '
                f'{quality.psnr_db:6.2f} {quality.ssim:6.4f} {quality.step_mean:10.2f} '
                f'{quality.step_worst:6.2f} {quality.edge:6.2f} {quality.flicker:8.3f}',
                flush=True,
            )
    out.mkdir(parents=True, exist_ok=True)
    (out / 'quality.json').write_text(json.dumps([vars(each) for each in results], indent=1))
    return report(results) | judge_posts(out) | judge_seams(out)


def report(results: list[Quality]) -> int:
    """Return whether the synthetic rig with unlike exposures meets the targets."""
    unlike, alike = (
        next(r for r in results if r.rig == f'synthetic {a} : {b}' and r.gain and r.blend == how)
        for (a, b), how in ((EXPOSURES[1], 'feather'), (EXPOSURES[0], 'feather'))
    )
    loss_db = alike.psnr_db - unlike.psnr_db
    checks = {
        f'step {unlike.step_worst:.2f} < {STEP_LIMIT}': unlike.step_worst < STEP_LIMIT,
        f'flicker {unlike.flicker:.3f} < {FLICKER_LIMIT}': unlike.flicker < FLICKER_LIMIT,
        f'loss {loss_db:.2f} dB < {LOSS_LIMIT_DB}': loss_db < LOSS_LIMIT_DB,
    }
    for what, is_met in checks.items():
        print(f'{"met" if is_met else "MISSED"}: {what}')
    return not all(checks.values())


def judged(pair: ImagePair, gains):
    """Judge each way to compose a pair; `gains` are the exposures of the synthetic rig."""
    settings = PanoramaSettings()
    stitcher = pair.stitcher(settings)
    for blend in BLENDS:
        for gain in (False, True):
            ours = replace(settings, blend=blend, gain_compensation=gain)
            yield judge(pair, stitcher.compositor(ours, pair.images), ours, gains)


def judge(pair: ImagePair, compositor: Compositor, settings: PanoramaSettings, gains) -> Quality:
    """Judge one way to compose a pair."""
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(pair.images, out)
    psnr_db = ssim = np.nan
    if pair.is_synthetic:
        truth = Scene().view(surface).frame(0).astype(np.float32)
        drawn = out.astype(np.float32)
        fair = drawn * (np.vdot(truth, drawn) / np.vdot(drawn, drawn))
        psnr_db = 10 * np.log10(255**2 / np.mean((fair - truth) ** 2))
        ssim = float(similarity_map(fair, truth).mean())
    step, edge = at_the_seam(out, pair, compositor)
    seam = compositor.layout.seams[0]
    columns = slice(seam.begin - 3, seam.end + 3)
    return Quality(
        pair.name,
        settings.blend,
        settings.gain_compensation,
        float(psnr_db),
        ssim,
        float(np.abs(step).mean()),
        float(np.abs(step).max()),
        edge,
        flicker(pair, compositor, columns, gains),
    )


def at_the_seam(out, pair: ImagePair, compositor: Compositor) -> tuple[np.ndarray, float]:
    """Step beside the seam, one number a patch of rows, and the sharpest edge in it."""
    layout, px_per_deg = compositor.layout, np.radians(compositor.layout.surface.focal_px)
    seam, reach = layout.seams[0], max(2, round(PATCH_DEG * px_per_deg))
    begin, end = seam.begin - reach, seam.end + reach
    alone = []
    window = layout.surface.window(begin, 0, end - begin, layout.surface.height)
    for index, view in enumerate(compositor.views):
        table = view.drawn_on(window)
        drawn = table(pair.images[index])
        factors = compositor.gain.factors[index] if compositor.gain else 1.0
        seen = view.shows_scene(table)[..., None]
        alone.append(np.where(seen, np.minimum(drawn * factors, 255), np.nan))
    difference = np.delete(alone[1] - alone[0], np.s_[reach:-reach], axis=1)
    rows = np.array_split(difference, len(difference) // PATCH_ROWS)
    step = np.array([np.nanmedian(patch) for patch in rows])
    profile = np.nanmean(out[:, begin:end] - alone[0], axis=(0, 2))
    return step[np.isfinite(step)], float(np.nanmax(np.abs(np.diff(profile))))


def flicker(pair: ImagePair, compositor: Compositor, columns: slice, gains) -> float:
    """Standard deviation over time of the brightness at the seam, against the truth."""
    rng = np.random.default_rng(1)
    noise = rng.normal(0, NOISE, (NOISES, *pair.images[0].shape)).round().astype(np.int16)
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    if pair.is_synthetic:
        views = [
            Scene().view(lens, Attitude(yaw_rad=yaw), gain)
            for lens, yaw, gain in zip(pair.lenses, YAWS, gains, strict=True)
        ]
        width = columns.stop - columns.start
        true_view = Scene().view(surface.window(columns.start, 0, width, surface.height))
    levels = []
    for i in range(FRAMES):
        stamp_ns = i * PERIOD_NS
        clean = [view.frame(stamp_ns) for view in views] if pair.is_synthetic else pair.images
        noisy = [cv2.add(image, rng.choice(noise), dtype=cv2.CV_8U) for image in clean]
        compositor.compose(noisy, out)
        level = out[:, columns].mean()
        if pair.is_synthetic:
            level /= true_view.frame(stamp_ns).mean()
        levels.append(level)
    scale = out[:, columns].mean() / levels[-1]
    return float(np.std(levels) * scale)


if __name__ == '__main__':
    try:
        sys.exit(main())
    except FisheyeError as error:
        sys.exit(f'The benchmark failed: {error}')
