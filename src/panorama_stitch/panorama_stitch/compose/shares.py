"""Shares: which camera shows which pixels of a virtual camera, and where two of them fade.

The seams are those of the panorama: what is a column there is a bearing here.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from panorama_stitch.compose.layout import Layout, Seam

_STANDS_IN = 1e-3
"""Weight of a camera outside of its own columns: it shows what no other camera does."""
_BODY = 1e-6
"""Weight of the robot itself."""
_BESIDE_SEAM_RAD = np.radians(20.0)
"""What a blend that needs the overlap gets of it, to each side."""

Box = tuple[slice, slice]
"""Rows and columns."""


class Seen(NamedTuple):
    """Where a camera shows anything, and anything but the robot; (height, width) bool each."""

    shows: np.ndarray
    scene: np.ndarray


@dataclass(frozen=True, eq=False)
class Joint:
    """A seam in the picture of a virtual camera.

    Attributes
    ----------
    left, right
        Indices of the cameras.
    box
        The part of the picture that is blended.
    zone
        (height, width) bool of the box: where both show the scene, and the blend is used.
    ramp
        (height, width) float32 of the box: how far the left camera has given way.
    """

    left: int
    right: int
    box: Box
    zone: np.ndarray
    ramp: np.ndarray


def distance_px(columns: np.ndarray, seam: Seam, layout: Layout) -> np.ndarray:
    """Return how far right of the middle of a seam columns of a panorama of bearings lie.

    Where it does not wrap, columns count by the whole turn that is nearest to its middle: an open
    panorama may reach past 180 degrees.
    """
    surface, seam_px = layout.surface, (seam.begin + seam.end - 1) / 2
    if layout.wraps:
        return _nearest_turn(columns - seam_px, surface.width)
    middle_px = (surface.width - 1) / 2
    turned = _nearest_turn(columns - middle_px, surface.circumference_px)
    return turned + middle_px - seam_px


def _nearest_turn(distance: np.ndarray, around: float) -> np.ndarray:
    """Add whole turns to distances so that they are as short as can be, to either side."""
    return (distance + around / 2) % around - around / 2


def ramps(layout: Layout, distances: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Return for each seam how far its left camera has given way, (height, width) 0 to 1."""
    widths = [max(seam.end - seam.begin, 1e-3) for seam in layout.seams]
    return [
        (distance / width + 0.5).clip(0, 1)
        for distance, width in zip(distances, widths, strict=True)
    ]


def owners(
    layout: Layout,
    faded: Sequence[np.ndarray],
    seen: dict[int, Seen],
    shape: tuple[int, int],
) -> np.ndarray:
    """Return the index of the camera that shows each pixel, (height, width) int8; -1 for none.

    Parameters
    ----------
    layout
        Of the panorama.
    faded
        As `ramps` returns them.
    seen
        Of each camera that may show anything, by its index.
    shape
        Height and width.
    """
    best, owner = np.zeros(shape, np.float32), np.full(shape, -1, np.int8)
    last = len(layout.order) - 1
    for at, index in enumerate(layout.order):
        if index not in seen:
            continue
        weight = np.ones(shape, np.float32)
        if faded and (at or layout.wraps):
            weight = weight * faded[at - 1]
        if faded and (at < last or layout.wraps):
            weight = weight * (1 - faded[at])
        shows, scene = seen[index]
        claim = np.where(scene, weight + _STANDS_IN, np.float32(_BODY)) * shows
        better = claim > best
        owner[better] = index
        best = np.maximum(best, claim)
    return owner


def joints(
    layout: Layout,
    distances: Sequence[np.ndarray],
    faded: Sequence[np.ndarray],
    seen: dict[int, Seen],
    owner: np.ndarray,
    *,
    needs_overlap: bool,
) -> list[Joint]:
    """Return the seams that are in a picture; `needs_overlap` as of the blend."""
    found = []
    reach_px = _BESIDE_SEAM_RAD * layout.surface.focal_px
    for at, (distance, ramp) in enumerate(zip(distances, faded, strict=True)):
        left, right = layout.order[at], layout.order[(at + 1) % len(layout.order)]
        if left not in seen or right not in seen:
            continue
        zone = (owner == left) | (owner == right)
        zone &= np.abs(distance) < reach_px if needs_overlap else (ramp > 0) & (ramp < 1)
        zone &= seen[left].scene & seen[right].scene
        if (box := box_of(zone)) is None:
            continue
        ramp = np.ascontiguousarray(ramp[box], np.float32)
        found.append(Joint(left, right, box, zone[box].copy(), ramp))
    return found


def box_of(where: np.ndarray) -> Box | None:
    """Return the smallest rows and columns that hold all that is True; None where nothing is."""
    rows, columns = (np.flatnonzero(where.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return None
    return slice(int(rows[0]), int(rows[-1]) + 1), slice(int(columns[0]), int(columns[-1]) + 1)


def united(boxes: Sequence[Box]) -> Box:
    """Return the smallest box that holds some others."""
    rows, columns = zip(*boxes, strict=True)
    return (
        slice(min(each.start for each in rows), max(each.stop for each in rows)),
        slice(min(each.start for each in columns), max(each.stop for each in columns)),
    )
