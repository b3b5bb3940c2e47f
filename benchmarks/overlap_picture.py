"""A picture of what overlap calibration did: particles and their match, overlap and seam."""

import cv2
import numpy as np

from fisheye_geometry.remap import RemapTable
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap

BOX, MATCH, EDGE, TEXT = (90, 170, 90), (0, 200, 255), (255, 160, 0), (255, 255, 255)
GAP, LINE_PX = 12, 22


def draw(
    pictures: tuple[np.ndarray, np.ndarray],
    surfaces: tuple[Surface, Surface],
    overlap: Overlap,
) -> np.ndarray:
    """Draw both views with their particles above what they make together.

    Parameters
    ----------
    pictures
        The corrected pictures (height, width) uint8.
    surfaces
        What they show.
    overlap
        What was measured on them.

    Returns
    -------
    ndarray
        (h, w, 3) uint8, BGR.
    """
    left, right = (cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) for picture in pictures)
    panorama = _compose(left, right, surfaces[1], overlap)
    half_start = left.shape[1] - left.shape[1] // 2
    _box(left, overlap.left_particles, overlap.left_match, half_start)
    _box(right, overlap.right_particles, overlap.right_match, 0)
    if overlap.found:
        x = round(overlap.offset_x_px)
        cv2.rectangle(left, (x, 0), (left.shape[1] - 1, left.shape[0] - 1), EDGE, 2)
        cv2.rectangle(right, (0, 0), (left.shape[1] - 1 - x, right.shape[0] - 1), EDGE, 2)
    views = _beside(left, right)
    width = max(views.shape[1], panorama.shape[1])
    text = np.zeros((2 * LINE_PX, width, 3), np.uint8)
    for line, words in enumerate((f'{overlap.method}, found: {overlap.found}', overlap.message)):
        origin = (6, LINE_PX * (line + 1) - 6)
        cv2.putText(text, words, origin, cv2.FONT_HERSHEY_SIMPLEX, 0.5, TEXT, 1, cv2.LINE_AA)
    return np.vstack([text, *(_widen(image, width) for image in (views, panorama))])


def _box(picture, particles, match, first_column):
    for index, p in enumerate(particles):
        matched = index == match
        corners = [
            (round(x) + first_column, round(y)) for x, y in ((p.left, p.top), (p.right, p.bottom))
        ]
        cv2.rectangle(picture, *corners, MATCH if matched else BOX, 3 if matched else 1)


def _compose(left, right, surface, overlap):
    """Lay the right view over the left one, and mark where it begins."""
    right = RemapTable(surface, surface, attitude=overlap.turn)(right)
    x, y = round(overlap.offset_x_px), round(overlap.offset_y_px)
    top = max(0, -y)
    height = max(left.shape[0] + top, right.shape[0] + top + y)
    width = max(left.shape[1], x + right.shape[1])
    canvas = np.zeros((height, width, 3), np.uint8)
    canvas[top : top + left.shape[0], : left.shape[1]] = left
    begin = max(x, 0)
    part = canvas[top + y : top + y + right.shape[0], begin : x + right.shape[1]]
    shown = right[:, begin - x :]
    np.copyto(part, shown, where=shown.max(axis=2, keepdims=True) > 0)
    for rows in (slice(0, 12), slice(height - 12, height)):
        canvas[rows, max(begin - 1, 0) : begin + 2] = EDGE
    return canvas


def _beside(left, right):
    height = max(left.shape[0], right.shape[0])
    gap = np.full((height, GAP, 3), 60, np.uint8)
    padded = [
        cv2.copyMakeBorder(one, 0, height - one.shape[0], 0, 0, cv2.BORDER_CONSTANT)
        for one in (left, right)
    ]
    return np.hstack([padded[0], gap, padded[1]])


def _widen(image, width):
    return cv2.copyMakeBorder(image, 0, 0, 0, width - image.shape[1], cv2.BORDER_CONSTANT)
