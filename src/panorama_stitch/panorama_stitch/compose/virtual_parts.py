"""Parts: which boxes of a virtual camera's picture are drawn of which camera, and blended."""

from collections.abc import Sequence
from typing import NamedTuple

import cv2
import numpy as np

from panorama_stitch.compose.blend import Blend
from panorama_stitch.compose.shares import Box, Joint, box_of, united
from panorama_stitch.compose.view import Cut, Table


class Part:
    """How one camera is drawn: a box of the picture, and where in it the camera is shown."""

    def __init__(self, cut: Cut, box: Box, mask: np.ndarray):
        self.cut, self.box, self.mask = cut, box, mask
        self._is_full = bool(mask.all())
        self._room = np.empty(0, np.uint8)

    def covers(self, shape: tuple[int, int]) -> bool:
        """Whether the camera shows all of a picture (height, width)."""
        return self._is_full and self.mask.shape == shape

    def room(self, out: np.ndarray) -> np.ndarray:
        """Return memory for the box, kept from frame to frame."""
        shape = self.mask.shape + out.shape[2:]
        if self._room.shape != shape:
            self._room = np.empty(shape, np.uint8)
        return self._room

    def inner(self, box: Box) -> Box:
        """Return where a box of the picture lies in this one."""
        top, left = self.box[0].start, self.box[1].start
        return (
            slice(box[0].start - top, box[0].stop - top),
            slice(box[1].start - left, box[1].stop - left),
        )


class JointBlend(NamedTuple):
    """A seam, and what blends it."""

    joint: Joint
    blend: Blend

    @property
    def left(self) -> int:
        """Index of the left camera."""
        return self.joint.left

    @property
    def right(self) -> int:
        """Index of the right camera."""
        return self.joint.right

    def draw(self, parts: dict[int, Part], drawn, out: np.ndarray, *, economical: bool) -> None:
        """Blend what is drawn of the two cameras into the picture."""
        joint = self.joint
        left, right = (
            np.ascontiguousarray(drawn[index][parts[index].inner(joint.box)])
            for index in (joint.left, joint.right)
        )
        self.blend(left, right, economical=economical)
        cv2.copyTo(right, joint.zone.view(np.uint8), out[joint.box])


def parts_of(
    tables: dict[int, Table], owner: np.ndarray, found: Sequence[Joint]
) -> dict[int, Part]:
    """Return how each camera is drawn that shows something, by its index."""
    parts = {}
    for index, table in tables.items():
        mine = owner == index
        boxes = [joint.box for joint in found if index in (joint.left, joint.right)]
        if own := box_of(mine):
            boxes.append(own)
        if boxes:
            box = united(boxes)
            parts[index] = Part(table.part(*box), box, mine[box].astype(np.uint8))
    return parts
