"""Whether posts stay straight at a seam: of several widths, at several distances and places.

A post is bent by so much as its two edges, where they are whole, stray from straight lines, px,
root mean square: the middle and the width of what is shown in each row make the edges. The room
behind is far away and rich; lenses are 10 cm apart.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rooms import FOCAL_PX, OVERLAP_DEG, RoomScene
from seams import SeamStrip, middle, share_of_crossing

RADII_M, DISTANCES_M, APART_M = (0.015, 0.03, 0.05), (1.0, 1.5, 2.0, 3.0), 0.10
PLACES = 16
_ROOM_M = 5.0
_LEAST_SHARE, _NOISE_SHARE = 0.5, 0.1
_END_ROWS = 3
_BENT_PX = 1.0
"""Most that a post may be bent in the median of all places, and more than a feather bends it."""


@dataclass(frozen=True)
class PostQuality:
    """What a blend makes of a post in all places; shares are 1 where all of it is shown."""

    width_m: float
    distance_m: float
    blend: str
    bent_px: float
    bent_worst_px: float
    shown_worst: float
    shown_best: float

    HEADER = 'post   distance  blend    bent px  worst  shown worst   best'

    def __str__(self) -> str:
        """Return a row of the table."""
        return (
            f'{100 * self.width_m:2.0f} cm {self.distance_m:8.1f} m  {self.blend:8s} '
            f'{self.bent_px:7.2f} {self.bent_worst_px:6.2f} '
            f'{self.shown_worst:12.0%} {self.shown_best:6.0%}'
        )


def judge_posts(out: Path) -> int:
    """Print the table, write out/posts.json, and return 1 if flow bends a post."""
    print(PostQuality.HEADER)
    results = []
    for scene in scenes():
        shots = list(scene.shots(PLACES))
        for blend in ('feather', 'flow'):
            results.append(_judge(scene, shots, blend))
            print(results[-1], flush=True)
    (out / 'posts.json').write_text(json.dumps([asdict(each) for each in results], indent=1))
    bent = [each for each in results if each.blend == 'flow' and each.bent_px > _BENT_PX]
    for each in bent:
        print(f'MISSED: bent by {each.bent_px:.2f} px: {each}')
    if not bent:
        print(f'met: flow bends no post by more than {_BENT_PX} px')
    return bool(bent)


def scenes() -> Iterator[RoomScene]:
    """Yield each post before a room of its own."""
    for radius_m in RADII_M:
        for distance_m in DISTANCES_M:
            seed = round(1000 * radius_m + 10 * distance_m)
            post = radius_m, distance_m
            yield RoomScene(_ROOM_M, APART_M, 'post', seed, post)


def bend_and_share(image: np.ndarray, truth: np.ndarray) -> tuple[float, float]:
    """Return how far, px, edges of what is coloured stray from straight lines, and its share."""
    shown, true = (share_of_crossing(each) for each in (image, truth))
    shown[shown < _NOISE_SHARE] = 0
    rows = np.flatnonzero(true.sum(axis=1) > _LEAST_SHARE)[_END_ROWS:-_END_ROWS]
    widths = shown[rows].sum(axis=1)
    middles = shown[rows] @ np.arange(image.shape[1]) / np.maximum(widths, _NOISE_SHARE)
    strays = []
    for edge in (middles - widths / 2, middles + widths / 2):
        line = np.polyval(np.polyfit(rows, edge, 1), rows)
        strays.append(float(np.sqrt(np.mean((edge - line) ** 2))))
    return max(strays), float(widths.sum() / true[rows].sum())


def _judge(scene: RoomScene, shots: list, blend: str) -> PostQuality:
    height, width = shots[0].midway.shape[:2]
    overlap = middle(width, OVERLAP_DEG)
    strip = SeamStrip(blend, height, overlap.stop - overlap.start, FOCAL_PX)
    found = []
    for shot in shots:
        image = shot.left.copy()
        image[:, overlap] = strip(shot.left[:, overlap], shot.right[:, overlap])
        image[:, overlap.stop :] = shot.right[:, overlap.stop :]
        found.append(bend_and_share(image, shot.midway))
    bends, shares = np.transpose(found)
    radius_m, distance_m = scene.post
    return PostQuality(
        2 * radius_m,
        distance_m,
        blend,
        float(np.median(bends)),
        float(bends.max()),
        float(shares.min()),
        float(shares.max()),
    )
