"""Local shifts over the overlap, and the offset and small turn of the right camera behind them.

The overlap is cut into tiles; each is looked for near where it is expected, and a robust fit tells
what they agree on. A tilted camera shifts the rows along the seam differently, which no single
offset can follow.
"""

from dataclasses import dataclass
from math import ceil, inf, radians

import cv2
import numpy as np

from fisheye_geometry.remap import Turn
from fisheye_geometry.surface import Surface
from panorama_stitch.structure import Structure

_TILE_RAD = radians(6.0)
_COLUMNS, _ROWS = 4, 18
"""At most so many tiles across and down the overlap."""
_SEEN_SHARE = 0.8
_WORTHLESS = 0.3
"""Correlation at and below which a tile says nothing about its shift."""
_CERTAINTY = 40.0
"""Turns the curvature of a tile's correlation into an inverse variance, 1/px^2."""
_LIKELY_TILT_RAD = radians(1.5)
_LIKELY_RISE_RAD = radians(0.5)
"""How far mounts are usually off: what decides where the overlap does not."""
_ROUNDS = 6


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
    level_y_px: float,
    search_rad: float,
    tilt: bool = True,
) -> Alignment:
    """Refine a pose by tiles.

    Parameters
    ----------
    left, right
        The two pictures at the same scale.
    surface
        The right picture's.
    start
        The pose to start from, px of these pictures.
    level_y_px
        The vertical offset of a level rig.
    search_rad
        How far from where it is expected each tile is looked for.
    tilt
        Whether the right camera may be turned.
    """
    pixels_per_rad = surface.focal_px
    size = max(8, round(_TILE_RAD * pixels_per_rad))
    reach = max(2, ceil(search_rad * pixels_per_rad))
    origins = _tiles(left.valid, right.valid, start, size)
    responses, tiles = [], []
    margin = (size - 1) / 2
    for origin, place in zip(origins, start.place(surface, origins + margin) - margin):
        tile = _Tile.find(left.detail, right.detail, origin, place, size, reach)
        if tile is not None:
            tiles.append(tile)
    if not tiles:
        return Alignment(start, 0.0, 0)
    pose = _fit(tiles, surface, start, level_y_px, search_rad, margin, tilt)
    moved = pose.place(surface, np.array([t.origin for t in tiles]) + margin) - margin
    weight = np.array([tile.weight for tile in tiles])
    agreement = np.array([tile.response_near(place) for tile, place in zip(tiles, moved)])
    return Alignment(pose, float(weight @ agreement / max(weight.sum(), 1e-6)), len(tiles))


def _tiles(left_valid, right_valid, pose, size) -> np.ndarray:
    """Upper left corners (n, 2) of tiles of the right picture that both pictures show."""
    x, y = round(pose.x_px), round(pose.y_px)
    (left_height, left_width), (height, width) = left_valid.shape, right_valid.shape
    x0, x1 = max(0, -x), min(width, left_width - x)
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


@dataclass(frozen=True)
class _Tile:
    """A tile of the right picture, looked for in the left one."""

    origin: np.ndarray
    shift: np.ndarray
    """From where it was expected to where it was found, px."""
    certainty: np.ndarray
    """(2, 2) inverse covariance of `shift`, 1/px^2."""
    weight: float
    responses: np.ndarray
    corner: tuple[int, int]
    """Place in the left picture that the first of `responses` is for."""

    @classmethod
    def find(cls, left, right, origin, place, size, reach):
        x, y = origin
        left_x, left_y = (max(0, round(float(p)) - reach) for p in place)
        right_x, right_y = (round(float(p)) + reach + size for p in place)
        window = left[left_y : max(right_y, 0), left_x : max(right_x, 0)]
        if min(window.shape) < size + 2:
            return None
        tile = right[y : y + size, x : x + size]
        responses = cv2.matchTemplate(window, tile, cv2.TM_CCOEFF_NORMED)
        _, best, _, (peak_x, peak_y) = cv2.minMaxLoc(responses)
        offset, curvature = _peak(responses, peak_x, peak_y)
        found = np.array([left_x + peak_x, left_y + peak_y]) + offset
        trust = max(best - _WORTHLESS, 0.0) ** 2 * _CERTAINTY
        weight = float(cv2.meanStdDev(tile)[1][0, 0] ** 2)
        return cls(origin, found - place, curvature * trust, weight, responses, (left_x, left_y))

    def response_near(self, place) -> float:
        """Correlation at a place of the left picture, to the nearest pixel or its neighbours."""
        x, y = (round(float(p)) - c for p, c in zip(place, self.corner))
        if x < -1 or y < -1:
            return 0.0
        near = self.responses[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
        return float(near.max()) if near.size else 0.0


def _peak(responses, x, y):
    """Sub-pixel place (2,) of a peak against its pixel, and the curvature (2, 2) there."""
    height, width = responses.shape
    if not (0 < x < width - 1 and 0 < y < height - 1):
        return np.zeros(2), np.zeros((2, 2))
    n = responses[y - 1 : y + 2, x - 1 : x + 2].astype(float)
    slope = np.array([n[1, 2] - n[1, 0], n[2, 1] - n[0, 1]]) / 2
    xx, yy = n[1, 0] + n[1, 2] - 2 * n[1, 1], n[0, 1] + n[2, 1] - 2 * n[1, 1]
    xy = (n[0, 0] + n[2, 2] - n[0, 2] - n[2, 0]) / 4
    values, vectors = np.linalg.eigh(-np.array([[xx, xy], [xy, yy]]))
    offset = np.clip(slope / np.maximum([-xx, -yy], 1e-3), -0.5, 0.5)
    return offset, vectors * np.maximum(values, 0) @ vectors.T


def _fit(tiles, surface, start, level_y_px, search_rad, margin, tilt) -> Pose:
    """Find the pose that most tiles agree on: iterated least squares, outliers weighed down.

    What the tiles leave open is decided by how mounts usually are; tiles count by the solid angle
    that they cover, so that the stretched rows far above and below the horizon do not win.
    """
    centers = np.array([tile.origin for tile in tiles]) + margin
    shifts = np.array([tile.shift for tile in tiles])
    rays = surface.rays(*centers.T)
    solid = (rays[:, [0, 2]] ** 2).sum(axis=1) / (rays**2).sum(axis=1)
    certainty = np.array([tile.certainty for tile in tiles]) * solid[:, None, None]
    jacobian = _jacobian(surface, start, centers)
    scale = surface.focal_px
    deviation = np.array([
        inf, _LIKELY_RISE_RAD * scale, *([_LIKELY_TILT_RAD if tilt else 1e-9] * 2),
    ])
    prior = np.diag(deviation**-2.0)
    usual = np.array([0.0, level_y_px - start.y_px, -start.pitch_rad, -start.roll_rad])
    step = np.array([*np.median(shifts, axis=0), 0.0, 0.0])
    for spread in np.geomspace(search_rad / 4, search_rad / 10, _ROUNDS) * scale:
        misfit = shifts - jacobian @ step
        robust = (1 + (misfit**2).sum(axis=1) / spread**2) ** -2
        weight = certainty * robust[:, None, None]
        normal = np.einsum('nki,nkl,nlj->ij', jacobian, weight, jacobian) + prior
        right = np.einsum('nki,nkl,nl->i', jacobian, weight, shifts) + prior @ usual
        step = np.linalg.lstsq(normal, right, rcond=None)[0]
    return Pose(
        start.x_px + step[0], start.y_px + step[1],
        start.pitch_rad + step[2], start.roll_rad + step[3],
    )


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
