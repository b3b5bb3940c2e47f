"""Random worlds to look at: textures, shapes, rooms, streets, slats, and nothing at all."""

from math import pi

import cv2
import numpy as np

WORLD_WIDTH = 3072
"""Pixels all around: as fine as the largest of the cameras."""
STYLES = ('texture', 'shapes', 'room', 'street', 'slats', 'bland')


def random_world(rng, style: str) -> np.ndarray:
    """Make what is all around: (h, 2 h) float32 of 1 to 255, equirectangular."""
    world = _STYLES[style](rng)
    low, high = rng.uniform(5, 60), rng.uniform(180, 260)
    world -= world.min()
    return (low + world * ((high - low) / max(float(world.max()), 1e-6))).clip(1, 255)


def cut(world: np.ndarray, rng, size_px: int, low: int, high: int) -> np.ndarray:
    """Cut a grey texture (size_px, size_px, 3) from `low` to `high` out of a world of uint8."""
    y, x = (rng.integers(0, side - size_px) for side in world.shape)
    part = world[y : y + size_px, x : x + size_px]
    return cv2.merge([cv2.normalize(part, None, low, high, cv2.NORM_MINMAX)] * 3)


def _blank(rng):
    rows = np.linspace(0, 1, WORLD_WIDTH // 2, dtype=np.float32)[:, None]
    return np.repeat(rows * rng.uniform(-60, 60), WORLD_WIDTH, axis=1)


def _texture(rng, coarsest: int, finest: int, rough: float) -> np.ndarray:
    """Noise of random octaves, from `coarsest` to `finest` cells around, seamless, about +-1."""
    shape = (WORLD_WIDTH // 2, WORLD_WIDTH)
    total = np.zeros(shape, np.float32)
    cells = coarsest
    while cells <= finest:
        noise = rng.standard_normal((max(cells // 2, 2), cells)).astype(np.float32)
        wrapped = np.hstack([noise, noise[:, :2]])
        width = WORLD_WIDTH * (cells + 2) // cells
        fine = cv2.resize(wrapped, (width, shape[0]), interpolation=cv2.INTER_CUBIC)
        total += (
            fine[:, WORLD_WIDTH // cells // 2 :][:, :WORLD_WIDTH] * (coarsest / cells) ** rough
        )
        cells *= 2
    return total / max(float(total.std()), 1e-6)


def _wrapped(left, right):
    """By how much to move what is drawn, so that it goes on across the back of the world."""
    return [0, *[-WORLD_WIDTH] * int(right >= WORLD_WIDTH), *[WORLD_WIDTH] * int(left < 0)]


def _shapes(rng, world, count, low=0.15, high=0.85):
    height = world.shape[0]
    for _ in range(count):
        x, y = rng.uniform(0, WORLD_WIDTH), rng.uniform(low, high) * height
        a, b = rng.uniform(0.004, 0.05, 2) * WORLD_WIDTH
        level, angle = rng.uniform(-120, 120), rng.uniform(0, 180)
        corners = np.array([x, y]) + rng.uniform(-1, 1, (rng.integers(3, 6), 2)) * (a, b)
        kind = rng.integers(3)
        for by in _wrapped(x - a - b, x + a + b):
            if kind == 0:
                cv2.ellipse(world, ((x + by, y), (a, b), angle), level, -1, cv2.LINE_AA)
            elif kind == 1:
                cv2.fillPoly(world, [np.int32(corners + np.array([by, 0]))], level, cv2.LINE_AA)
            else:
                first, last = (int(x + by - a), int(y - b)), (int(x + by + a), int(y + b))
                cv2.rectangle(world, first, last, level, -1)


def _make_texture(rng):
    world = _blank(rng) + _texture(rng, 8, int(2 ** rng.integers(7, 11)), rng.uniform(0.2, 1)) * 40
    _shapes(rng, world, int(rng.integers(0, 30)))
    return world


def _make_shapes(rng):
    world = _blank(rng)
    _shapes(rng, world, int(rng.integers(60, 250)))
    return world + _texture(rng, 64, 1024, 0.3) * rng.uniform(0, 4)


def _make_room(rng):
    world = _blank(rng) * 0.5
    height, width = world.shape
    edges = np.sort(rng.uniform(0, width, rng.integers(4, 9))).astype(int)
    for left, right in zip(edges, np.roll(edges, -1), strict=True):
        right = right if right > left else right + width
        columns = np.arange(left, right) % width
        world[:, columns] += rng.uniform(-30, 30) + np.linspace(
            0, rng.uniform(-20, 20), len(columns)
        )
    floor, ceiling = int(height * rng.uniform(0.58, 0.7)), int(height * rng.uniform(0.25, 0.38))
    world[:ceiling] = rng.uniform(60, 100) + _texture(rng, 8, 16, 1)[:ceiling] * 3
    world[floor:] = rng.uniform(-90, 0) + _floor(rng, height - floor, floor / height)
    for _ in range(int(rng.integers(25, 60))):
        _fitting(rng, world, ceiling, floor)
    _shapes(rng, world, int(rng.integers(5, 25)), 0.4, 0.75)
    return world + _texture(rng, 128, 1024, 0.3) * rng.uniform(0.5, 3)


def _fitting(rng, world, ceiling, floor):
    """Door, window, shelf or picture on a wall: a frame around a panel."""
    x, w = rng.uniform(0, WORLD_WIDTH), rng.uniform(0.01, 0.05) * WORLD_WIDTH
    top = rng.uniform(ceiling + 5, floor - 60)
    bottom = floor if rng.random() < 0.4 else rng.uniform(top + 30, floor)
    frame, panel, inset = rng.uniform(-100, 100), rng.uniform(-100, 100), rng.uniform(3, 12)
    for by in _wrapped(x - w, x + w):
        for level, less in ((frame, 0), (panel, inset)):
            first = int(x + by - w / 2 + less), int(top + less)
            last = int(x + by + w / 2 - less), int(bottom - less)
            cv2.rectangle(world, first, last, level, -1)


def _floor(rng, rows, start):
    """Planks or tiles on a floor, seen in perspective: (rows, WORLD_WIDTH)."""
    down = (start + (1 - start) * (np.arange(rows) + 0.5) / rows - 0.5) * pi
    azimuth = np.linspace(-pi, pi, WORLD_WIDTH, endpoint=False) + rng.uniform(0, pi)
    far = 1 / np.tan(down)[:, None]
    x, z = far * np.sin(azimuth) + rng.uniform(), far * np.cos(azimuth) + rng.uniform()
    size = rng.uniform(0.15, 0.6)
    i, j = np.floor(x / size), np.floor(z / size / rng.uniform(1, 4))
    shade = np.sin(i * rng.uniform(10, 99) + j * rng.uniform(10, 99)) * rng.uniform(5, 30)
    return cv2.GaussianBlur(shade.astype(np.float32), (0, 0), 1.5)


def _make_street(rng):
    world = _blank(rng) * 0.3
    height, width = world.shape
    horizon = height // 2
    world[:horizon] += 80 + _texture(rng, 8, 64, 1)[:horizon] * rng.uniform(2, 15)
    world[horizon:] += _texture(rng, 32, 1024, rng.uniform(0.3, 0.9))[horizon:] * rng.uniform(
        5, 25
    )
    x = 0
    while x < width:
        wide = int(rng.uniform(0.02, 0.1) * width)
        top = int(horizon - rng.uniform(0, 0.25) * height)
        right = min(x + wide, width)
        if rng.random() < 0.3:
            trees = _texture(rng, 128, 1024, 0.4)[top:horizon, x:right]
            world[top:horizon, x:right] = -40 + trees * rng.uniform(10, 40)
        else:
            _house(rng, world, x, right, top, horizon + int(rng.uniform(0, 0.05) * height))
        x = right
    _shapes(rng, world, int(rng.integers(5, 25)), 0.45, 0.65)
    return world


def _house(rng, world, left, right, top, bottom):
    world[top:bottom, left:right] = rng.uniform(-100, 60)
    step_x, step_y = rng.integers(14, 50), rng.integers(18, 60)
    pane = rng.uniform(-120, 100)
    for x in range(left + step_x // 3, right - step_x // 2, step_x):
        for y in range(top + step_y // 3, bottom - step_y // 2, step_y):
            world[y : y + step_y // 2, x : x + step_x // 2] = pane + rng.uniform(-15, 15)


def _make_slats(rng):
    world = _make_room(rng)
    height, width = world.shape
    period = rng.uniform(2, 8) / 360 * width
    phase = np.arange(width) % period < period * rng.uniform(0.3, 0.7)
    top, bottom = np.sort(rng.uniform(0.3, 0.7, 2)) * height
    rows = slice(int(top), max(int(bottom), int(top) + 40))
    world[rows] = np.where(phase, rng.uniform(30, 100), rng.uniform(-100, -30))
    _shapes(rng, world, int(rng.integers(10, 40)), 0.3, 0.7)
    return world


def _make_bland(rng):
    """Sky and smooth walls, nothing to hold on to."""
    world = _blank(rng) + _texture(rng, 8, 16, 1.0) * 20
    world[world.shape[0] // 2 :] -= rng.uniform(0, 60)
    return cv2.GaussianBlur(world, (0, 0), rng.uniform(1, 20))


_STYLES = {name: globals()[f'_make_{name}'] for name in STYLES}
