"""Find what a small patch shows in another picture, to parts of a pixel."""

import cv2
import numpy as np

HALF_PX = 8
"""Pixels from the middle of a patch to its edge."""
_LEAST_CONTRAST = 3.0
_MOST_ZOOM = 1.5
_MOST_SHIFT_PX = 2.0
"""By how much shear and stretch may move a patch from where it was found without them."""
_STOP = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 20, 1e-4)
_NO_BLUR = 1


def zoomed(picture: np.ndarray, where: np.ndarray, zoom: float) -> np.ndarray:
    """Return the patch about a place (2,) of a picture, as it looks from another distance."""
    zoom = float(np.clip(zoom, 1 / _MOST_ZOOM, _MOST_ZOOM))
    shift = HALF_PX - zoom * where
    to_patch = np.array([[zoom, 0, shift[0]], [0, zoom, shift[1]]])
    return cv2.warpAffine(picture, to_patch, (2 * HALF_PX + 1,) * 2)


def find_patch(
    picture: np.ndarray,
    where: np.ndarray,
    patch: np.ndarray,
    reach_px: int,
    least: float,
    *,
    sheared: bool,
) -> np.ndarray | None:
    """Find a patch near a place of a picture.

    Parameters
    ----------
    picture
        (height, width) uint8.
    where
        (2,) column and row at which the middle of the patch should be.
    patch
        (2 HALF_PX + 1,) squared, uint8.
    reach_px
        How far from there it may be.
    least
        Correlation from which on it is found.
    sheared
        Whether it may be sheared and stretched.

    Returns
    -------
    ndarray or None
        (2,) column and row of its middle; None if it is not there.
    """
    window = _cut(picture, where, HALF_PX + reach_px)
    if window is None or patch.std() < _LEAST_CONTRAST:
        return None
    shift = _peak(cv2.matchTemplate(window, patch, cv2.TM_CCOEFF_NORMED), least)
    if shift is not None and sheared:
        shift = _warped(window, patch, shift)
    return None if shift is None else np.round(where) + shift - reach_px


def _cut(picture: np.ndarray, where: np.ndarray, half: int) -> np.ndarray | None:
    """Return the part about a place, or None where the picture ends before."""
    x, y = np.round(where).astype(int)
    height, width = picture.shape
    if not (half <= x < width - half and half <= y < height - half):
        return None
    return picture[y - half : y + half + 1, x - half : x + half + 1]


def _peak(score: np.ndarray, least: float) -> np.ndarray | None:
    """Return column and row of the highest point, None where it is low or at an edge."""
    _, best, _, (x, y) = cv2.minMaxLoc(score)
    inside = 0 < x < score.shape[1] - 1 and 0 < y < score.shape[0] - 1
    if best < least or not inside:
        return None
    place = []
    for at, (low, high) in (
        (x, (score[y, x - 1], score[y, x + 1])),
        (y, (score[y - 1, x], score[y + 1, x])),
    ):
        bend = low - 2 * best + high
        place.append(at + (0.5 * (low - high) / bend if bend < 0 else 0.0))
    return np.array(place)


def _warped(window: np.ndarray, patch: np.ndarray, shift: np.ndarray) -> np.ndarray | None:
    """Return where the patch is in the window when it may be sheared and stretched.

    From another place a wall is seen more obliquely, and looks narrower: what correlates best as
    it is lies beside the truth. Evangelidis and Psarakis 2008, doi 10.1109/TPAMI.2008.113.
    """
    warp = np.column_stack([np.eye(2), shift]).astype(np.float32)
    try:
        _, warp = cv2.findTransformECC(
            patch, window, warp, cv2.MOTION_AFFINE, _STOP, None, _NO_BLUR
        )
    except cv2.error:
        return None  # it did not converge
    middle = np.array([HALF_PX, HALF_PX])
    moved = warp[:, :2] @ middle + warp[:, 2] - middle
    return moved if np.abs(moved - shift).max() < _MOST_SHIFT_PX else None
