"""The time at which a picture was taken, painted into it so that it survives lens and codec."""

import numpy as np

_TIME_BITS = 16
_CHECK_BITS = 4
BLOCKS = _TIME_BITS + _CHECK_BITS
"""Black or white blocks in a row around the centre of the picture."""
WRAP_MS = 1 << _TIME_BITS
SPAN = 0.75
"""Share of the picture's width that the blocks take."""
_HEIGHT = 1 / 5
_CONTRAST = 60
"""Grey levels between black and white below which there is nothing to read."""
_NS_PER_MS = 1_000_000


def paint(image: np.ndarray, time_ns: int) -> None:
    """Paint a time, to the millisecond, across the middle of an image (height, width[, 3])."""
    time_ms = time_ns // _NS_PER_MS % WRAP_MS
    value = time_ms << _CHECK_BITS | _check(time_ms)
    height, width = image.shape[:2]
    edges = np.rint(width * (0.5 + SPAN * (np.arange(BLOCKS + 1) / BLOCKS - 0.5))).astype(int)
    rows = slice(round(height * (1 - _HEIGHT) / 2), round(height * (1 + _HEIGHT) / 2))
    for block in range(BLOCKS):
        is_white = value >> (BLOCKS - 1 - block) & 1
        image[rows, edges[block] : edges[block + 1]] = 235 if is_white else 20


def centres_px(width: int) -> np.ndarray:
    """Return the columns (BLOCKS,) of the blocks' centres in an image of a width."""
    return width * (0.5 + SPAN * ((np.arange(BLOCKS) + 0.5) / BLOCKS - 0.5)) - 0.5


def read(levels: np.ndarray) -> int | None:
    """Return the painted time, ms modulo `WRAP_MS`, from the grey level (BLOCKS,) of each block.

    None if it is torn, smeared or not there.
    """
    levels = np.asarray(levels, float)
    if np.ptp(levels) < _CONTRAST:
        return None
    middle = (levels.min() + levels.max()) / 2
    value = 0
    for level in levels:
        value = value << 1 | int(level > middle)
    time_ms, check = value >> _CHECK_BITS, value & (1 << _CHECK_BITS) - 1
    return time_ms if check == _check(time_ms) else None


def read_image(image: np.ndarray) -> int | None:
    """Return the time that was painted into an image (height, width[, 3]) of the camera."""
    grey = image if image.ndim == 2 else image.mean(axis=2)
    height = len(grey)
    columns = np.rint(centres_px(image.shape[1])).astype(int)
    return read(grey[height // 2 - 1 : height // 2 + 2, columns].mean(axis=0))


def age_ms(painted_ms: int, now_ns: int) -> float:
    """Return how long before a time, ns since the epoch, a painted time was."""
    age = (now_ns / _NS_PER_MS - painted_ms) % WRAP_MS
    return age - WRAP_MS if age > WRAP_MS / 2 else age


def _check(time_ms: int) -> int:
    nibbles = [time_ms >> shift & 15 for shift in range(0, _TIME_BITS, _CHECK_BITS)]
    return (5 + 3 * sum(i * nibble for i, nibble in enumerate(nibbles, 1))) & 15
