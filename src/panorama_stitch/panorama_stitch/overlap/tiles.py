"""Tiles of the overlap: how well each fits at and around its place in the other picture."""

from itertools import product
from math import ceil, inf, radians

import cv2
import numpy as np

from panorama_stitch.overlap.pose import Pose
from panorama_stitch.overlap.structure import FacingPair

_TILE_RAD = radians(6.0)
_SMALLEST_TILE_PX = 12
_SHORTEST_REACH_PX = 4
_COLUMNS, _ROWS = 4, 18
"""At most so many tiles across and down the overlap."""
_SEEN_SHARE = 0.8
_FAINTEST = 0.01
"""Structure below it is rounding."""
_LIKELY_TILT_RAD = radians(1.5)
_LIKELY_RISE_RAD = radians(0.2)
"""How far mounts are usually off: what decides where the overlap does not."""
_TILTS_RAD = tuple(radians(tilt) for tilt in (0.0, -1.5, 1.5))
_BEST = 0.9
"""Correlation that no tile is believed to exceed: noise, parallax and interpolation remain."""
_GRAIN_PX = 6.0
"""Pixels that change together, as far as evidence is concerned."""
_NEIGHBOURHOODS = (3, 2, 1, 1, 0)
"""How far from the pose each round of `climb` looks for a tile's peak, px."""
_SQUARE = np.arange(-1, 2)


class Tiles:
    """Tiles of the right picture, each correlated with where it may lie in the left one.

    Pictures whose difference is Gaussian noise of unknown gain fit with a log likelihood of
    ``-n / 2 log(1 - r^2)`` at a correlation of r over n independent pixels; a pose is as likely
    as its tiles together and as mounts usually are.

    Parameters
    ----------
    facing
        The pictures.
    start
        Where to begin.
    search_rad
        How far from where it is expected each tile is correlated.
    tilt
        Whether the right camera may be turned.
    """

    def __init__(self, facing: FacingPair, start: Pose, search_rad: float, tilt: bool):
        surface = facing.surface
        size = max(_SMALLEST_TILE_PX, round(_TILE_RAD * surface.focal_px))
        self._reach = max(_SHORTEST_REACH_PX, ceil(search_rad * surface.focal_px))
        self._tilt = tilt
        origins = _origins(facing, start, size, self._reach // 3)
        margin = (size - 1) / 2
        centers = origins + margin
        places = start.place(surface, centers) - margin
        corners = np.rint(places).astype(int) - self._reach
        self._center = places - corners
        self._jacobian = start.jacobian(surface, centers)
        side = 2 * self._reach + 1
        fits = np.zeros((len(origins), side, side), np.float32)
        self._known = np.zeros(fits.shape, bool)
        for fit, known, origin, corner in zip(fits, self._known, origins, corners, strict=True):
            _correlate(fit, known, facing, origin, corner, size)
        rays = surface.rays(*centers.T)
        # Rows far above and below the horizon are stretched: tiles count by their solid angle.
        solid = (rays[:, [0, 2]] ** 2).sum(axis=1) / (rays**2).sum(axis=1)
        pixels = size * size / _GRAIN_PX * solid[:, None, None]
        self._likelihood = -0.5 * pixels * np.log1p(-((_BEST * fits.clip(0)) ** 2))
        self._prior = _prior(facing, start, tilt)

    def __len__(self) -> int:
        return len(self._likelihood)

    def search(self) -> np.ndarray:
        """Find the likeliest step (4,) from the start on a grid of shifts and tilts."""
        tilts = np.array(list(product(_TILTS_RAD, repeat=2))) if self._tilt else np.zeros((1, 2))
        reach, side = self._reach, 2 * self._reach + 1
        moves = self._center - reach + np.einsum('nkt,mt->mnk', self._jacobian[:, :, 2:], tilts)
        moves = np.clip(np.rint(moves).astype(int), -reach, reach)
        columns, rows = (moves[..., [k]] + reach + np.arange(side) for k in (0, 1))
        padded = np.pad(self._likelihood, ((0, 0), (reach, reach), (reach, reach)))
        tile = np.arange(len(self))[:, None, None]
        # What each tile says of each shift, moved by what each tilt does to it: (tilt, y, x).
        total = padded[tile, rows[..., :, None], columns[..., None, :]].sum(axis=1)
        precision, usual = self._prior
        unlikely = 0.5 * ((tilts - usual[2:]) ** 2) @ np.diag(precision)[2:]
        total -= unlikely[:, None, None]
        tilt, y, x = np.unravel_index(np.argmax(total), total.shape)
        return np.array([x - reach, y - reach, *tilts[tilt]], float)

    def climb(self, step: np.ndarray) -> np.ndarray:
        """Go uphill from a step (4,) to the likeliest one, to a fraction of a pixel."""
        precision, usual = self._prior
        for neighbourhood in _NEIGHBOURHOODS:
            spots = self._spots(step, neighbourhood)
            slope, curvature = self._parabola(spots)
            away = self._where(step) - spots
            slope = slope - np.einsum('nij,nj->ni', curvature, away)
            jacobian = self._jacobian
            normal = np.einsum('nki,nkl,nlj->ij', jacobian, curvature, jacobian) + precision
            uphill = np.einsum('nki,nk->i', jacobian, slope) + precision @ (usual - step)
            step = step + np.linalg.lstsq(normal, uphill, rcond=None)[0]
        return step if self._tilt else np.append(step[:2], (0.0, 0.0))

    def _where(self, step):
        """Places (n, 2) in the tiles' maps that a step leads to."""
        return self._center + self._jacobian @ step

    def _spots(self, step, neighbourhood):
        """Pixels (n, 2) of the maps with the highest likelihood near a step, inside their rims."""
        last = 2 * self._reach - 1
        nearest = np.clip(np.rint(self._where(step)).astype(int), 1, last)
        span = np.arange(-neighbourhood, neighbourhood + 1)
        columns, rows = (np.clip(nearest[:, [k]] + span, 1, last) for k in (0, 1))
        tile = np.arange(len(self))
        near = self._likelihood[tile[:, None, None], rows[:, :, None], columns[:, None, :]]
        best = near.reshape(len(self), -1).argmax(axis=1)
        row, column = np.divmod(best, len(span))
        return np.stack([columns[tile, column], rows[tile, row]], axis=-1)

    def _parabola(self, spots):
        """Slope (n, 2) and downward curvature (n, 2, 2) of the maps; 0 where they are unknown."""
        where = (
            np.arange(len(self))[:, None, None],
            spots[:, 1, None, None] + _SQUARE[:, None],
            spots[:, 0, None, None] + _SQUARE,
        )
        v = self._likelihood[where]
        slope = np.stack([v[:, 1, 2] - v[:, 1, 0], v[:, 2, 1] - v[:, 0, 1]], axis=-1) / 2
        xx = 2 * v[:, 1, 1] - v[:, 1, 0] - v[:, 1, 2]
        yy = 2 * v[:, 1, 1] - v[:, 0, 1] - v[:, 2, 1]
        xy = (v[:, 0, 2] + v[:, 2, 0] - v[:, 0, 0] - v[:, 2, 2]) / 4
        values, vectors = np.linalg.eigh(np.stack([xx, xy, xy, yy], axis=-1).reshape(-1, 2, 2))
        curvature = np.einsum('nij,nj,nkj->nik', vectors, values.clip(0), vectors)
        known = self._known[where].all(axis=(1, 2))
        return slope * known[:, None], curvature * known[:, None, None]


def _prior(facing, start, tilt):
    """How likely a step is before anything is seen: precision (4, 4) and likeliest step (4,)."""
    likely_tilt = _LIKELY_TILT_RAD if tilt else 1e-9
    deviation = np.array(
        [inf, _LIKELY_RISE_RAD * facing.surface.focal_px, likely_tilt, likely_tilt]
    )
    usual = np.array([0.0, facing.level_y_px - start.y_px, -start.pitch_rad, -start.roll_rad])
    return np.diag(deviation**-2.0), usual


def _origins(facing, pose, size, inset) -> np.ndarray:
    """Upper left corners (n, 2) of tiles of the right picture that both pictures show."""
    left, right = facing.left.valid, facing.right.valid
    x, y = round(pose.x_px), round(pose.y_px)
    (left_height, left_width), (height, width) = left.shape, right.shape
    x0, x1 = max(0, -x) + inset, min(width, left_width - x) - inset
    y0, y1 = max(0, -y), min(height, left_height - y)
    across, down = min(_COLUMNS, (x1 - x0) // size), min(_ROWS, (y1 - y0) // size)
    if across < 1 or down < 1:
        return np.zeros((0, 2), int)
    both = left[y0 + y : y1 + y, x0 + x : x1 + x] & right[y0:y1, x0:x1]
    columns = np.linspace(0, x1 - x0 - size, across).astype(int)
    rows = np.linspace(0, y1 - y0 - size, down).astype(int)
    seen = _box_sums(both, size)[np.ix_(rows, columns)]
    row, column = np.nonzero(seen >= _SEEN_SHARE * size * size)
    return np.stack([columns[column] + x0, rows[row] + y0], axis=-1)


def _correlate(fit, known, facing, origin, corner, size):
    """Fill in one tile's map: its correlation with each place of the left picture, if all seen."""
    (x0, y0), (x1, y1) = np.maximum(corner, 0), np.maximum(corner + len(fit) - 1 + size, 0)
    window = facing.left.image[y0:y1, x0:x1]
    x, y = origin
    tile = facing.right.image[y : y + size, x : x + size]
    # Of an empty tile, OpenCV says that it fits everywhere.
    if min(window.shape) < size or cv2.norm(tile, cv2.NORM_INF) < _FAINTEST:
        return
    responses = cv2.matchTemplate(window, tile, cv2.TM_CCOEFF_NORMED)
    seen = _box_sums(facing.left.valid[y0:y1, x0:x1], size) == size * size
    column, row = (x0, y0) - corner
    part = slice(row, row + len(responses)), slice(column, column + responses.shape[1])
    fit[part] = responses * seen
    known[part] = seen


def _box_sums(values, size):
    """Sum of each `size` x `size` square that lies inside."""
    total = cv2.integral(values)
    return (
        total[size:, size:] - total[:-size, size:] - total[size:, :-size] + total[:-size, :-size]
    )
