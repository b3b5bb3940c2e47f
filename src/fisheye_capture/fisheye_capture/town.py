"""A town at dusk, painted all around the viewer: what the synthetic cameras look at."""

from math import pi

import cv2
import numpy as np

from fisheye_capture.canvas import Canvas, around, faces_of_box

EYE_HEIGHT_M = 1.6
_STOREY_M = 3.0

# All colours are BGR, and dark enough for an exposure of 1.3.
_SKY = np.array([(104, 62, 36), (130, 86, 58), (150, 122, 118), (140, 156, 186), (112, 160, 196)])
"""From the zenith to the horizon."""
_CLOUD = np.array((150, 150, 186))
_HILLS = ((0.17, (116, 100, 98)), (0.09, (80, 80, 70)))
"""Heights, rad, and colours, the far ones first."""
_TILES = np.array([(98, 116, 130), (70, 82, 96)])
_FAR_GROUND = np.array((86, 98, 104))
_WALLS = np.array([(92, 112, 150), (118, 108, 96), (84, 96, 118), (132, 128, 120), (78, 88, 136)])
_GLASS = np.array([(136, 184, 196), (72, 58, 48), (86, 70, 56)])
_PAINTS = np.array([(60, 70, 180), (170, 120, 50), (70, 150, 80), (60, 160, 190), (150, 80, 140)])
_BARK, _LEAVES = np.array([(44, 56, 74), (52, 104, 70)])
_INK, _CHALK = np.array([(40, 36, 34), (190, 194, 196)])


def paint_town(width: int, seed: int) -> Canvas:
    """Paint the town that belongs to a seed, `width` columns all around."""
    random = np.random.default_rng(seed)
    canvas = Canvas(width)
    _paint_sky(canvas, random)
    _paint_hills(canvas, random)
    _paint_ground(canvas, random)
    _paint_ring(canvas, random, _paint_house, count=19, distance_m=(16, 30))
    _paint_ring(canvas, random, _paint_tree, count=13, distance_m=(10, 14))
    _paint_ring(canvas, random, _paint_crate, count=10, distance_m=(3.5, 7))
    _paint_bearings(canvas)
    return canvas


def _paint_ring(canvas, random, paint, count, distance_m):
    """Paint things of one kind all around, the far ones first."""
    numbers = np.arange(count) + random.uniform(-0.2, 0.2, count)
    bearings_rad = numbers * 2 * pi / count - pi
    distances_m = random.uniform(*distance_m, count)
    for nearness in np.argsort(-distances_m):
        bearing_rad = bearings_rad[nearness]
        place = around(bearing_rad, distances_m[nearness], EYE_HEIGHT_M)
        paint(canvas, random, place, bearing_rad)


def _paint_sky(canvas, random):
    """Paint a smooth sky, which a quarter of the resolution is enough for."""
    height, width = canvas.picture.shape[:2]
    coarse = width // 4, height // 8
    rows = np.linspace(0, len(_SKY) - 1, coarse[1])
    gradient = np.stack([np.interp(rows, range(len(_SKY)), c) for c in _SKY.T], axis=-1)
    clouds = np.zeros(coarse[::-1])
    for cells in (3, 6, 12, 24):
        noise = random.uniform(-1, 1, (2 * cells, 3 * cells))
        noise[:, -1] = noise[:, 0]
        clouds += cv2.resize(noise, coarse, interpolation=cv2.INTER_CUBIC) * 3 / cells
    cover = np.clip(clouds + 0.1, 0, 1)[..., None] * 0.6
    sky = gradient[:, None] * (1 - cover) + _CLOUD * cover
    canvas.picture[: height // 2] = cv2.resize(sky.astype(np.uint8), (width, height // 2))


def _paint_hills(canvas, random):
    bearings = np.linspace(-pi, pi, 721)
    horizon = canvas.picture.shape[0] / 2
    x = (bearings + pi) * canvas.surface.focal_px
    for height_rad, color in _HILLS:
        tops = height_rad + sum(
            height_rad / 3 / n**0.7 * np.sin(n * bearings + random.uniform(0, 2 * pi))
            for n in (2, 3, 5, 9, 17, 31)
        )
        y = horizon - np.maximum(tops, 0) * canvas.surface.focal_px
        canvas.outline(np.r_[x, x[-1], x[0]], np.r_[y, horizon, horizon], color)


def _paint_ground(canvas, random):
    """Square tiles of 1 m as far as they can be told apart; the viewer stands on one."""
    canvas.picture[canvas.picture.shape[0] // 2 :] = _FAR_GROUND
    corners = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]) * 0.96
    reach = 15
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            color = _TILES[(i + j) % 2] * random.uniform(0.85, 1.15) + random.uniform(-8, 8, 3)
            distance = np.hypot(i, j)
            if 0 < distance < reach:
                fade = (distance / reach) ** 2
                x, z = (corners + np.array([i, j])).T
                tile = np.stack([x, np.full(4, EYE_HEIGHT_M), z], axis=-1)
                canvas.polygon(tile, color * (1 - fade) + _FAR_GROUND * fade)


def _paint_house(canvas, random, place, bearing_rad):
    paint = _WALLS[random.integers(len(_WALLS))]
    height_m = _STOREY_M * random.integers(2, 6) + 0.6
    width_m, depth_m = random.uniform(5, 9), random.uniform(4, 7)
    for face in faces_of_box(place, bearing_rad + random.uniform(-0.5, 0.5), width_m, depth_m):
        wall = paint * face.light
        canvas.rectangle(face, 0, 0, face.width_m, height_m, wall)
        canvas.rectangle(face, -0.15, height_m - 0.5, face.width_m + 0.3, 0.5, wall * 0.6)
        columns = int(face.width_m / 1.9)
        pitch_m = face.width_m / columns
        door = random.integers(columns)
        for column in range(columns):
            u = (column + 0.24) * pitch_m
            for v in np.arange(0.9, height_m - 1, _STOREY_M):
                glass = _GLASS[random.integers(len(_GLASS))]
                canvas.rectangle(face, u - 0.1, v - 0.1, pitch_m * 0.52 + 0.2, 1.7, wall * 0.7)
                canvas.rectangle(face, u, v, pitch_m * 0.52, 1.5, glass)
            if column == door:
                wood = _PAINTS[random.integers(len(_PAINTS))] * face.light
                canvas.rectangle(face, u - 0.1, 0, pitch_m * 0.6, 2.65, wood)


def _paint_tree(canvas, random, place, bearing_rad):
    face, *_ = faces_of_box(place, bearing_rad, 0.35, 0.35)
    height_m = random.uniform(2.5, 4.5)
    canvas.rectangle(face, 0, 0, face.width_m, height_m, _BARK)
    angle = np.linspace(0, 2 * pi, 24, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    for light in np.linspace(0.7, 1.4, 12):
        middle = np.array([face.width_m / 2, height_m + light - 0.5])
        spread = random.uniform(-1, 1, 2) * (0.9, 0.8) * (1.6 - light / 2)
        leaves = middle + spread + circle * random.uniform(0.4, 0.8)
        canvas.polygon(face.at(leaves), _LEAVES * light)


def _paint_crate(canvas, random, place, bearing_rad):
    side_m = random.uniform(0.8, 1.3)
    margin_m, inner_m = 0.12 * side_m, 0.76 * side_m
    paint = _PAINTS[random.integers(len(_PAINTS))]
    points = random.integers(3, 7)
    angle = np.linspace(0, 2 * pi, 2 * points, endpoint=False)
    radius = np.where(np.arange(2 * points) % 2, 0.16, 0.34)[:, None]
    star = (np.stack([np.sin(angle), np.cos(angle)], axis=-1) * radius + 0.5) * side_m
    for face in faces_of_box(place, bearing_rad + random.uniform(-0.7, 0.7), side_m, side_m):
        canvas.rectangle(face, 0, 0, side_m, side_m, paint * face.light * 0.7)
        canvas.rectangle(face, margin_m, margin_m, inner_m, inner_m, paint * face.light)
        canvas.polygon(face.at(star), _CHALK * face.light)


def _paint_bearings(canvas):
    """Write the bearing along the horizon every 10 degrees, a tick every 5."""
    px_per_deg = np.radians(canvas.surface.focal_px)
    height = canvas.picture.shape[0]
    font = cv2.FONT_HERSHEY_DUPLEX
    scale = 2.0 * px_per_deg / cv2.getTextSize('0', font, 1, 1)[0][1]
    for bearing_deg in range(-180, 185, 5):
        x = (bearing_deg + 180) * px_per_deg
        for ink, thick in ((_INK, 0.75), (_CHALK, 0.25)):
            color = ink.tolist()
            thickness = max(1, round(thick * px_per_deg))
            tick = [(round(x), round(height / 2 + y * px_per_deg)) for y in (0.6, 1.6)]
            cv2.line(canvas.picture, *tick, color, thickness, cv2.LINE_AA)
            if bearing_deg % 10 == 0:
                text = f'{bearing_deg:+d}' if bearing_deg % 180 else f'{abs(bearing_deg)}'
                (text_width, _), _ = cv2.getTextSize(text, font, scale, 1)
                place = (round(x - text_width / 2), round(height / 2 - 0.2 * px_per_deg))
                cv2.putText(
                    canvas.picture, text, place, font, scale, color, thickness, cv2.LINE_AA
                )
