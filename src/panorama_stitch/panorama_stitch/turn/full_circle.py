"""Find where a turn comes round: the frame that shows again what the first one shows."""

from collections.abc import Sequence

import cv2
import numpy as np

from fisheye_core.errors import CalibrationError
from panorama_stitch.turn.corners import APART_WIDTHS, QUALITY, followed, lit

Frame = tuple[np.ndarray, ...]

_THUMBNAIL = 48, 36
_LEAST_FRAMES = 12
_LEAST_LIKENESS = 0.5
_LEAST_SHARE = 0.3
_BEYOND = 3
"""Frames after it that make the end of a turn sure: they are less and less like the first."""
_CORNERS = 500


def has_come_round(frames: Sequence[Frame]) -> bool:
    """Whether the newest frames are beyond the one that is like the first."""
    if len(frames) <= _LEAST_FRAMES + _BEYOND:
        return False
    likeness = _likeness([frames[0], *frames[-_BEYOND:]])[1:]
    is_past = likeness.argmax() == 0 and likeness[0] > _LEAST_LIKENESS
    return bool(is_past) and _shows(frames[-_BEYOND], frames[0])


def closing_frame(frames: Sequence[Frame]) -> int:
    """Return the number of the frame that shows again what the first one shows, one turn later.

    Raises
    ------
    CalibrationError
        If none does.
    """
    if len(frames) <= _LEAST_FRAMES:
        raise CalibrationError(
            f'only {len(frames)} pictures were kept, each when the scene had moved; expected a '
            'full turn on the spot'
        )
    likeness = _likeness(frames)
    # Below the ends and beyond them nothing is alike.
    before, after = np.append(0.0, likeness[:-1]), np.append(likeness[1:], 0.0)
    peaks = (likeness >= before) & (likeness > after) & (likeness > _LEAST_LIKENESS)
    for peak in np.flatnonzero(peaks):
        if peak >= _LEAST_FRAMES and _shows(frames[peak], frames[0]):
            return int(peak)
    raise CalibrationError(
        f'none of {len(frames)} pictures shows again what the first one shows (likeness '
        f'{likeness[_LEAST_FRAMES:].max():.2f} at best); expected a full turn on the spot, and a '
        'little more'
    )


def seen_again(
    frames: Sequence[Frame], last: int, camera: int
) -> list[tuple[int, int, np.ndarray, np.ndarray]]:
    """Follow corners across the end of the turn, where frame `last` is like the first.

    Returns
    -------
    list
        Pairs of frames, (last, 0) first, and pixels (n, 2) of the same corners in each.
    """
    both = [(last, 0), (last - 1, 0)]
    both += [(late, late - last) for late in range(last + 1, len(frames))]
    pairs = []
    for late, early in both:
        points, there, good = _corners_in(frames[late][camera], frames[early][camera])
        pairs.append((late, early, points[good], there[good]))
    return pairs


def _shows(frame: Frame, first: Frame) -> bool:
    """Whether most corners of a frame are found in the first one, camera by camera."""
    shares = []
    for before, after in zip(frame, first, strict=True):
        _, _, good = _corners_in(before, after)
        shares.append(good.mean() if len(good) else 0.0)
    return min(shares) > _LEAST_SHARE


def _corners_in(
    before: np.ndarray, after: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return corners (n, 2) of a picture, where they are in another, and which are there."""
    found = cv2.goodFeaturesToTrack(
        before, _CORNERS, QUALITY, before.shape[1] * APART_WIDTHS, mask=lit(before)
    )
    points = np.zeros((0, 2), np.float32) if found is None else found.reshape(-1, 2)
    return points, *followed(before, after, points, points)


def _likeness(frames: Sequence[Frame]) -> np.ndarray:
    """Correlation (T,) of what frames show with what the first one shows."""
    small = np.array([_thumbnail(pictures) for pictures in frames])
    return small @ small[0]


def _thumbnail(pictures: tuple[np.ndarray, ...]) -> np.ndarray:
    small = [
        cv2.resize(picture, _THUMBNAIL, interpolation=cv2.INTER_AREA).astype(np.float32)
        for picture in pictures
    ]
    flat = np.concatenate([(cv2.GaussianBlur(s, (0, 0), 1.0) - s.mean()).ravel() for s in small])
    return flat / max(float(np.linalg.norm(flat)), 1e-6)
