"""The offset, and the small turn of the right camera, that close the seam from top to bottom.

The overlap is cut into tiles, and each is correlated with where it may lie in the left picture. A
tilted camera shifts the tiles along the seam differently, which no single offset can follow: the
pose is sought at which the tiles together correlate best.
"""

from dataclasses import dataclass
from itertools import product
from math import ceil, radians

import cv2
import numpy as np

from fisheye_geometry.remap import Turn
from fisheye_geometry.surface import Surface
from panorama_stitch.structure import Structure

_TILE_RAD = radians(6.0)
_COLUMNS, _ROWS = 4, 18
"""At most so many tiles across and down the overlap."""
_SEEN_SHARE = 0.8
_LIKELY_TILT_RAD = radians(1.5)
_LIKELY_RISE_RAD = radians(0.5)
"""How far mounts are usually off: what decides where the overlap does not."""
_TILTS_RAD = tuple(radians(t) for t in (-2.0, -1.0, 0.0, 1.0, 2.0))
_GRAIN_PX = 6.0
_SUREST = 0.9
_WITHIN = (3, 2, 1, 1, 0)


@dataclass(frozen=True)
class Pose:
    """Where the right picture lies in the left one, px, with the right camera turned, rad."""

    x_px: float
    y_px: float
    pitch_rad: float = 0.0
    roll_rad: float = 0.0

    @property
    def turn(self) -> Turn:
        """The right camera's turn that the offset is meant with."""
        return Turn(0.0, self.pitch_rad, self.roll_rad)

    def scaled(self, factor: float) -> 'Pose':
        """Give the same pose in pixels of another size."""
        return Pose(self.x_px * factor, self.y_px * factor, self.pitch_rad, self.roll_rad)

    def place(self, surface: Surface, points: np.ndarray) -> np.ndarray:
        """Where points (n, 2) of the right picture lie in the left one, px."""
        rays = surface.rays(points[:, 0], points[:, 1]) @ self.turn.matrix.T
        pixels, _ = surface.project(rays)
        return pixels + (self.x_px, self.y_px)


@dataclass(frozen=True)
class Alignment:
    """A pose and how far the tiles agree on it.

    Attributes
    ----------
    agreement
        Zero-mean normalised cross-correlation of the overlap, tile by tile, at this pose.
    tiles
        How many there were.
    """

    pose: Pose
    agreement: float
    tiles: int


def align(
    left: Structure,
    right: Structure,
    surface: Surface,
    start: Pose,
    usual: Pose,
    search_rad: float,
    tilt: bool = True,
) -> Alignment:
    size = max(8, round(_TILE_RAD * surface.focal_px))
    reach = max(2, ceil(search_rad * surface.focal_px))
    origins = _tiles(left.valid, right.valid, start, size, reach // 3)
    if not len(origins):
        return Alignment(start, 0.0, 0)
    tiles = _Tiles(left.detail, left.valid, right.detail, surface, start, origins, size, reach)
    step = tiles.search() if tilt else tiles.search_shift(np.zeros(2))
    step = tiles.climb(step, start, usual, tilt)
    pose = Pose(
        start.x_px + step[0], start.y_px + step[1],
        start.pitch_rad + step[2], start.roll_rad + step[3],
    )
    return Alignment(pose, tiles.agreement(step), len(origins))


class _Tiles:
    """Tiles of the right picture and how well each fits around its place in the left one."""

    def __init__(self, left, left_valid, right, surface, start, origins, size, reach):
        margin = (size - 1) / 2
        centers = origins + margin
        places = start.place(surface, centers) - margin
        self._jacobian = _jacobian(surface, start, centers)
        self._rounding = np.rint(places) - places
        self._reach = reach
        self._scale = surface.focal_px
        side = 2 * reach + 1
        self._responses = np.zeros((len(origins), side, side), np.float32)
        self._known = np.zeros((len(origins), side, side), bool)
        self._weight = np.zeros(len(origins))
        for i, ((x, y), place) in enumerate(zip(origins, np.rint(places).astype(int))):
            tile = right[y : y + size, x : x + size]
            x0, y0 = np.maximum(place - reach, 0)
            x1, y1 = np.maximum(place + reach + size, 0)
            window = left[y0:y1, x0:x1]
            if min(window.shape) < size:
                continue
            fit = cv2.matchTemplate(window, tile, cv2.TM_CCOEFF_NORMED)
            column, row = (x0, y0) - (place - reach)
            self._responses[i, row : row + fit.shape[0], column : column + fit.shape[1]] = fit
            seen = cv2.integral(left_valid[y0:y1, x0:x1])
            seen = seen[size:, size:] - seen[:-size, size:] - seen[size:, :-size] + seen[:-size, :-size]
            self._known[i, row : row + fit.shape[0], column : column + fit.shape[1]] = seen >= size * size
            self._weight[i] = cv2.meanStdDev(tile)[1][0, 0] ** 2
        rays = surface.rays(*centers.T)
        solid = (rays[:, [0, 2]] ** 2).sum(axis=1) / (rays**2).sum(axis=1)
        self._weight /= max(self._weight.sum(), 1e-6)
        self._responses *= self._known
        self._known = np.stack([
            cv2.erode(k.astype(np.uint8), np.ones((3, 3), np.uint8), borderType=cv2.BORDER_CONSTANT, borderValue=0) for k in self._known
        ]) > 0
        known = np.log1p(-(_SUREST * np.maximum(self._responses, 0)) ** 2)
        self._likelihood = known * (-0.5 * size * size / _GRAIN_PX * solid[:, None, None])
        blur = lambda r: cv2.blur(r, (3, 3))
        self._wide = np.stack([blur(r) for r in self._likelihood])

    def search(self):
        return max(
            (self.search_shift(np.array(tilt)) for tilt in product(_TILTS_RAD, repeat=2)),
            key=self.likelihood,
        )

    def search_shift(self, tilt):
        """Best shift with this tilt."""
        move = self._jacobian[:, :, 2:] @ tilt - self._rounding
        column, row = np.rint(move).astype(int).T
        r = self._reach
        total = np.zeros((2 * r + 1, 2 * r + 1), np.float32)
        for response, dx, dy in zip(self._wide, column, row):
            a0, a1 = max(0, -dy), min(2 * r + 1, 2 * r + 1 - dy)
            b0, b1 = max(0, -dx), min(2 * r + 1, 2 * r + 1 - dx)
            if a1 > a0 and b1 > b0:
                total[a0:a1, b0:b1] += response[a0 + dy : a1 + dy, b0 + dx : b1 + dx]
        y, x = np.unravel_index(np.argmax(total), total.shape)
        return np.array([x - r, y - r, *tilt], float)

    def _spots(self, step):
        """Nearest pixels (n, 2) of the responses for a step, inside their rims; what is left."""
        move = self._jacobian @ step - self._rounding + self._reach
        spot = np.clip(np.rint(move), 1, 2 * self._reach - 1).astype(int)
        return spot, move - spot

    def _peaks(self, step, within):
        spot, rest = self._spots(step)
        if not within:
            return spot, rest
        span = np.arange(-within, within + 1)
        last = 2 * self._reach - 1
        rows = np.clip(spot[:, 1, None, None] + span[:, None], 1, last)
        columns = np.clip(spot[:, 0, None, None] + span, 1, last)
        i = np.arange(len(spot))
        near = self._likelihood[i[:, None, None], rows, columns].reshape(len(spot), -1)
        y, x = np.unravel_index(near.argmax(axis=1), (len(span), len(span)))
        peak = np.stack([columns[i, 0, x], rows[i, y, 0]], axis=-1)
        return peak, rest + spot - peak

    def climb(self, step, start, usual, tilt):
        deviation = np.array([np.inf, _LIKELY_RISE_RAD * self._scale, *([_LIKELY_TILT_RAD if tilt else 1e-9] * 2)])
        prior = np.diag(deviation ** -2.0)
        mean = np.array([0, usual.y_px - start.y_px, usual.pitch_rad - start.pitch_rad, usual.roll_rad - start.roll_rad])
        for within in _WITHIN:
            slope, curvature = self._shape(step, within)
            J = self._jacobian
            H = np.einsum('nki,nkl,nlj->ij', J, curvature, J) + prior
            g = np.einsum('nki,nk->i', J, slope) + prior @ (mean - step)
            move = np.linalg.lstsq(H, g, rcond=None)[0]
            step = step + move
        return step

    def _shape(self, step, within):
        spot, rest = self._peaks(step, within)
        slope, curvature = self._quadratic(self._likelihood, spot)
        known = self._known[np.arange(len(spot)), spot[:, 1], spot[:, 0]]
        slope, curvature = slope * known[:, None], curvature * known[:, None, None]
        return slope - np.einsum('nij,nj->ni', curvature, rest), curvature

    @staticmethod
    def _quadratic(maps, spot):
        i = np.arange(len(spot))[:, None, None]
        n = maps[i, spot[:, 1, None, None] + np.arange(-1, 2)[:, None], spot[:, 0, None, None] + np.arange(-1, 2)]
        slope = np.stack([n[:, 1, 2] - n[:, 1, 0], n[:, 2, 1] - n[:, 0, 1]], axis=-1) / 2
        xx, yy = n[:, 1, 0] + n[:, 1, 2] - 2 * n[:, 1, 1], n[:, 0, 1] + n[:, 2, 1] - 2 * n[:, 1, 1]
        xy = (n[:, 0, 0] + n[:, 2, 2] - n[:, 0, 2] - n[:, 2, 0]) / 4
        hessian = -np.stack([np.stack([xx, xy], -1), np.stack([xy, yy], -1)], -1)
        values, vectors = np.linalg.eigh(hessian)
        return slope, np.einsum('nij,nj,nkj->nik', vectors, np.maximum(values, 0), vectors)

    def likelihood(self, step):
        spot, _ = self._spots(step)
        return self._wide[np.arange(len(spot)), spot[:, 1], spot[:, 0]].sum()

    def agreement(self, step):
        spot, rest = self._spots(step)
        slope, curvature = self._quadratic(self._responses, spot)
        rest = np.clip(rest, -0.5, 0.5)
        here = self._responses[np.arange(len(spot)), spot[:, 1], spot[:, 0]]
        here = here + (slope * rest).sum(1) - 0.5 * np.einsum('ni,nij,nj->n', rest, curvature, rest)
        known = self._known[np.arange(len(spot)), spot[:, 1], spot[:, 0]]
        return float(self._weight[known] @ here[known] / max(self._weight[known].sum(), 1e-3))


def _tiles(left_valid, right_valid, pose, size, inset) -> np.ndarray:
    """Upper left corners (n, 2) of tiles of the right picture that both pictures show."""
    x, y = round(pose.x_px), round(pose.y_px)
    (left_height, left_width), (height, width) = left_valid.shape, right_valid.shape
    x0, x1 = max(0, -x) + inset, min(width, left_width - x) - inset
    y0, y1 = max(0, -y), min(height, left_height - y)
    across, down = (min(most, (b - a) // size) for most, a, b in (
        (_COLUMNS, x0, x1), (_ROWS, y0, y1),
    ))
    if across < 1 or down < 1:
        return np.zeros((0, 2), int)
    both = left_valid[y0 + y : y1 + y, x0 + x : x1 + x] & right_valid[y0:y1, x0:x1]
    total = cv2.integral(both)
    columns = np.linspace(0, x1 - x0 - size, across).astype(int)
    rows = np.linspace(0, y1 - y0 - size, down).astype(int)[:, None]
    seen = (
        total[rows + size, columns + size] - total[rows, columns + size]
        - total[rows + size, columns] + total[rows, columns]
    )
    row, column = np.nonzero(seen >= _SEEN_SHARE * size * size)
    return np.stack([columns[column] + x0, rows[row, 0] + y0], axis=-1)


def _jacobian(surface, pose, points, by=1e-3):
    """How points (n, 2) move with the pose: (n, 2, 4)."""
    here = pose.place(surface, points)
    jacobian = np.zeros((len(points), 2, 4))
    jacobian[:, 0, 0] = jacobian[:, 1, 1] = 1
    pitched = Pose(pose.x_px, pose.y_px, pose.pitch_rad + by, pose.roll_rad)
    rolled = Pose(pose.x_px, pose.y_px, pose.pitch_rad, pose.roll_rad + by)
    jacobian[:, :, 2] = (pitched.place(surface, points) - here) / by
    jacobian[:, :, 3] = (rolled.place(surface, points) - here) / by
    return jacobian
