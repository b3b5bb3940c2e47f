"""What becomes of near things at a seam, for each blend: rooms with true depth.

The truth is the view from midway between the lenses. Who crosses is coloured, the room is grey,
so how much of them is shown is a sum of colours; the share is of what the truth shows. Ghosts are
pixels in whose whole neighbourhood they are half transparent, other than in the truth: outlines
are narrower. The wobble is how much pixels change from frame to frame where nothing moves, noise
of the cameras among it.
"""

import json
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import cv2
import numpy as np
from moving_least_squares import MovingLeastSquares
from rooms import CHROMA, CROSSINGS, FOCAL_PX, OVERLAP_DEG, RoomScene, Shot
from similarity import similarity_map

from panorama_stitch.compose.blend import Feather, Multiband
from panorama_stitch.compose.flow import Flow

NEAREST_M, APART_M = (0.5, 1.0, 2.0, 5.0), (0.05, 0.15, 0.30)
FADE_DEG, MULTIBAND_DEG = 2.0, 8.0
_SEAM_DEG = 4.0
_GHOST = 0.25, 0.75
"""Between these shares of who crosses and of the room a pixel shows a ghost."""
_AROUND_PX = 9
"""Pixels that who crosses may blur into are not still."""
WAYS = 'none', 'feather', 'multiband', 'flow', 'mls', 'mls each'
"""The blends, and to compare with, moving least squares found once and for each frame."""
_FAR_M, _CLOSE_M = 2.0, 0.15
"""What flow must gain it must gain from there on, with lenses no farther apart."""
_GAIN_DB, _SEAM_GAIN_DB, _SHOWN, _WOBBLE = 2.0, 3.0, (0.85, 1.15), 1.1
_NOTHING_DB, _NOTHING_SSIM, _NOTHING_SHOWN, _NOTHING_PX = 0.1, 0.005, 0.01, 5
"""No worse than feather: within what nobody sees. dB, SSIM, share, px."""


@dataclass(frozen=True)
class SeamQuality:
    """What a blend makes of a scene; shares of who crosses are 1 where all of them is shown."""

    nearest_m: float
    apart_m: float
    crossing: str
    blend: str
    overlap_db: float
    seam_db: float
    overlap_ssim: float
    seam_ssim: float
    shown_worst: float
    shown_best: float
    ghost_px: float
    wobble: float

    HEADER = (
        'nearest  apart  crossing blend      overlap dB  seam dB  overlap  seam SSIM  '
        'shown worst  best  ghost px  wobble'
    )

    def __str__(self) -> str:
        """Return a row of the table."""
        rig = f'{self.nearest_m:5.1f} m {100 * self.apart_m:3.0f} cm'
        crossing = self.crossing or 'turning'
        return (
            f'{rig}  {crossing:8s} {self.blend:9s} {self.overlap_db:11.2f} {self.seam_db:8.2f} '
            f'{self.overlap_ssim:8.4f} {self.seam_ssim:10.4f} {self.shown_worst:12.0%} '
            f'{self.shown_best:5.0%} {self.ghost_px:9.1f} {self.wobble:7.2f}'
        )


def judge_seams(out: Path) -> int:
    """Print the table, write out/seams.json, and return 1 if flow misses a target."""
    print(SeamQuality.HEADER)
    results = []
    for scene in scenes():
        for quality in judged(scene, scene.shots(), WAYS):
            results.append(quality)
            print(quality, flush=True)
    (out / 'seams.json').write_text(json.dumps([asdict(each) for each in results], indent=1))
    by_scene = zip(*(iter(results),) * len(WAYS), strict=True)
    misses = [miss for each in by_scene for miss in missed(each[1], each[3])]
    print('\n'.join(misses) or 'met: all that is asked of flow beside feather')
    return bool(misses)


def missed(feather: SeamQuality, flow: SeamQuality) -> Iterator[str]:
    """List the targets that flow misses in a scene."""
    scene = f'{flow.nearest_m} m, {flow.apart_m} m apart, {flow.crossing or "turning"}'
    gain, seam_gain = flow.overlap_db - feather.overlap_db, flow.seam_db - feather.seam_db
    is_far = flow.nearest_m >= _FAR_M and flow.apart_m <= _CLOSE_M
    least, seam_least = (_GAIN_DB, _SEAM_GAIN_DB) if is_far else (-_NOTHING_DB,) * 2
    checks = {
        f'{gain:.2f} dB in the overlap': gain >= least,
        f'{seam_gain:.2f} dB at the seam': seam_gain >= seam_least,
    }
    for name in ('overlap_ssim', 'seam_ssim'):
        less = getattr(feather, name) - getattr(flow, name)
        checks[f'{name} less by {less:.4f}'] = less <= _NOTHING_SSIM
    if flow.crossing:
        low, high = flow.shown_worst, flow.shown_best
        if is_far and flow.crossing == 'person':
            checks[f'{low:.0%} to {high:.0%} shown'] = low >= _SHOWN[0] and high <= _SHOWN[1]
        less = feather.shown_worst - low
        checks[f'{less:.0%} less shown at worst'] = less <= _NOTHING_SHOWN
        limit = feather.ghost_px + _NOTHING_PX
        checks[f'{flow.ghost_px:.0f} px of ghost'] = flow.ghost_px <= limit
        factor = flow.wobble / feather.wobble
        checks[f'{factor:.2f} times the wobble'] = factor <= _WOBBLE
    return (f'MISSED: {scene}: {what}' for what, is_met in checks.items() if not is_met)


def scenes() -> Iterator[RoomScene]:
    """Yield all rooms: each with each who crosses, and some in which the robot turns."""
    for nearest_m in NEAREST_M:
        for apart_m in APART_M:
            for crossing in CROSSINGS:
                yield RoomScene(nearest_m, apart_m, crossing)
        yield RoomScene(nearest_m, 0.15)


class SeamStrip:
    """An overlap, of which a blend is given the columns that it needs."""

    def __init__(self, blend: str, height: int, width: int, focal_px: float):
        needed = {'none': 0, 'feather': FADE_DEG, 'multiband': MULTIBAND_DEG}
        count = min(width, round(np.radians(needed.get(blend, OVERLAP_DEG)) * focal_px))
        begin = (width - count) // 2 if count else 0
        self._columns = slice(begin, begin + count)
        seen = np.ones((height, count), bool)
        half = round(np.radians(FADE_DEG) * focal_px) / 2
        fade = round(count / 2 - half), round(count / 2 + half)
        self._blend = {
            'none': lambda: None,
            'feather': lambda: Feather(seen, seen),
            'multiband': lambda: Multiband(seen, seen),
            'flow': lambda: Flow(seen, seen, fade),
            'mls': lambda: MovingLeastSquares(seen, seen, fade),
            'mls each': lambda: MovingLeastSquares(seen, seen, fade, each_frame=True),
        }[blend]()

    def __call__(self, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Make one picture of two views of the overlap."""
        out = right.copy()
        out[:, : self._columns.start] = left[:, : self._columns.start]
        if self._blend:
            self._blend(left[:, self._columns].copy(), out[:, self._columns])
        return out


def judged(
    scene: RoomScene, shots: Iterable[Shot], blends: Iterable[str]
) -> Iterator[SeamQuality]:
    """Judge each blend on the shots of a scene."""
    shots = list(shots)
    for blend in blends:
        yield _judge(scene, shots, blend)


def _judge(scene: RoomScene, shots: list[Shot], blend: str) -> SeamQuality:
    height, width = shots[0].midway.shape[:2]
    overlap, seam = (middle(width, degrees) for degrees in (OVERLAP_DEG, _SEAM_DEG))
    strip = SeamStrip(blend, height, overlap.stop - overlap.start, FOCAL_PX)
    errors, alike, shown, ghosts, changes = [], [], [], [], []
    before = None
    for shot in shots:
        out = np.hstack(
            [
                shot.left[:, : overlap.start],
                strip(shot.left[:, overlap], shot.right[:, overlap]),
                shot.right[:, overlap.stop :],
            ]
        )
        error = (np.float32(out) - shot.midway) ** 2
        ssim = similarity_map(out, shot.midway)
        errors.append([error[:, part].mean() for part in (overlap, seam)])
        alike.append([ssim[:, part].mean() for part in (overlap, seam)])
        ours, true = (share_of_crossing(picture) for picture in (out, shot.midway))
        if scene.crossing:
            shown.append(ours.sum() / true.sum())
            ghosts.append(max(0, _ghosts(ours) - _ghosts(true)))
        still = ~cv2.dilate(shot.moving.astype(np.uint8), np.ones((_AROUND_PX,) * 2)).astype(bool)
        still[:, : overlap.start] = still[:, overlap.stop :] = False
        if before is not None and scene.crossing:
            change = (np.float32(out) - before[0])[still & before[1]]
            changes.append(np.mean(change**2))
        before = out, still
    psnr = -10 * np.log10(np.mean(errors, axis=0) / 255**2)
    return SeamQuality(
        scene.nearest_m,
        scene.apart_m,
        scene.crossing,
        blend,
        *(float(value) for value in psnr),
        *(float(value) for value in np.mean(alike, axis=0)),
        float(min(shown, default=np.nan)),
        float(max(shown, default=np.nan)),
        float(np.mean(ghosts)) if ghosts else np.nan,
        float(np.sqrt(np.mean(changes))) if changes else np.nan,
    )


def middle(width: int, degrees: float) -> slice:
    """Return the columns of so many degrees in the middle of a view."""
    half = np.radians(degrees / 2) * FOCAL_PX
    return slice(round(width / 2 - half), round(width / 2 + half))


def share_of_crossing(image: np.ndarray) -> np.ndarray:
    """How much of each pixel shows who crosses."""
    return (np.float32(image[..., 2]) - image[..., 1]) / CHROMA


def _ghosts(share: np.ndarray) -> int:
    half = ((share > _GHOST[0]) & (share < _GHOST[1])).astype(np.uint8)
    return int(np.count_nonzero(cv2.erode(half, np.ones((3, 3)), borderValue=0)))
