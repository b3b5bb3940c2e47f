"""One picture of how a panorama came about: raw, corrected with particles, stitched."""

from collections.abc import Sequence

import cv2
import numpy as np

_TILE_HEIGHT_PX = 300
_GAP_PX = 8
_CAPTION_PX = 28
_BACKGROUND, _INK = (32, 32, 32), (235, 235, 235)
_BOX, _MATCH = (80, 200, 80), (60, 60, 255)


def contact_sheet(rows: Sequence[Sequence[tuple[str, np.ndarray]]]) -> np.ndarray:
    """Lay out rows of pictures, each (caption, (height, width, 3) uint8), under each other."""
    strips = [_strip([_tile(*entry) for entry in row]) for row in rows]
    width = max(strip.shape[1] for strip in strips)
    return np.vstack([_padded(strip, width) for strip in strips])


def with_particles(picture: np.ndarray, particles, match: int, left_px: int) -> np.ndarray:
    """Box the particles of a picture's facing half, which begins at column `left_px`."""
    drawn = picture.copy()
    for index, particle in enumerate(particles):
        corners = [(particle.left, particle.top), (particle.right, particle.bottom)]
        points = [(round(x) + left_px, round(y)) for x, y in corners]
        is_match = index == match
        cv2.rectangle(drawn, *points, _MATCH if is_match else _BOX, 3 if is_match else 1)
    return drawn


def _tile(caption: str, picture: np.ndarray) -> np.ndarray:
    if picture.ndim == 2:
        picture = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR)
    width = round(picture.shape[1] * _TILE_HEIGHT_PX / picture.shape[0])
    small = cv2.resize(picture, (width, _TILE_HEIGHT_PX), interpolation=cv2.INTER_AREA)
    tile = cv2.copyMakeBorder(small, _CAPTION_PX, 0, 0, 0, cv2.BORDER_CONSTANT, value=_BACKGROUND)
    cv2.putText(tile, caption, (2, 20), cv2.FONT_HERSHEY_SIMPLEX, 0.55, _INK, 1, cv2.LINE_AA)
    return tile


def _strip(tiles: Sequence[np.ndarray]) -> np.ndarray:
    framed = [
        cv2.copyMakeBorder(tile, _GAP_PX, 0, _GAP_PX, 0, cv2.BORDER_CONSTANT, value=_BACKGROUND)
        for tile in tiles
    ]
    return np.hstack(framed)


def _padded(strip: np.ndarray, width: int) -> np.ndarray:
    missing = width - strip.shape[1] + _GAP_PX
    return cv2.copyMakeBorder(
        strip, 0, _GAP_PX, 0, missing, cv2.BORDER_CONSTANT, value=_BACKGROUND
    )
