"""Constructed pairs of views of one world, whose overlap is known exactly."""

from math import pi, radians

import cv2
import numpy as np

from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.camera_file import read_camera
from fisheye_geometry.image_circle import ImageCircle
from fisheye_geometry.lens import FisheyeLens
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.surface import Surface
from fisheye_testing.data import real_data
from panorama_stitch.compose.placing import place
from panorama_stitch.compose.posing import views_at_overlaps
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.overlap_result import Overlap

YAW_DEG = 140.0
_AROUND = 2048


def lens(width: int = 640, height: int = 480, fov_deg: float = 170.0) -> FisheyeLens:
    """Return an equidistant lens whose image circle is as wide as its picture."""
    focal = width / radians(fov_deg)
    return FisheyeLens(
        width,
        height,
        focal,
        focal,
        (width - 1) / 2,
        (height - 1) / 2,
        (0.0,) * 4,
        visible_angle_rad=radians(fov_deg) / 2,
    )


def world(seed: int = 0) -> np.ndarray:
    """Return a world of blots of all sizes on a textured ground, (1024, 2048) uint8."""
    rng = np.random.default_rng(seed)
    noise = rng.normal(0, 1, (_AROUND // 2, _AROUND)).astype(np.float32)
    picture = cv2.GaussianBlur(noise, (0, 0), 4) * 150 + 110
    for _ in range(400):
        x, y = rng.uniform(0, _AROUND), rng.uniform(0.15, 0.85) * _AROUND / 2
        size = tuple(rng.uniform(8, 90, 2))
        cv2.ellipse(picture, ((x, y), size, rng.uniform(0, 180)), rng.uniform(20, 230), -1)
    return _in_range(picture)


def slats(period_deg: float) -> np.ndarray:
    """Return a world of upright slats that repeat themselves all around."""
    degrees = np.arange(_AROUND) * (360 / _AROUND)
    row = np.where(degrees % period_deg < period_deg / 2, 60, 190)
    return np.repeat(row[None], _AROUND // 2, axis=0).astype(np.uint8)


def look(world: np.ndarray, surface: Surface, yaw_deg: float, lens: FisheyeLens) -> np.ndarray:
    """Return the corrected picture of a level camera, 0 outside its image circle."""
    height, width = world.shape
    sphere = Surface(
        'equirectangular', width, height, width / 2 / pi, (width - 1) / 2, (height - 1) / 2
    )
    picture = RemapTable(sphere, surface, attitude=Attitude(-radians(yaw_deg)))(world)
    return np.where(RemapTable(lens, surface).valid, np.maximum(picture, 1), 0).astype(np.uint8)


def pair(
    kind: str = 'cylindrical', seed: int = 0, yaw_deg: float = YAW_DEG, scene=None, camera=None
):
    """Return ((left, right), (left surface, right surface), true offset in px) of a level rig."""
    camera = camera or lens()
    surface = surface_for(camera, kind)
    scene = world(seed) if scene is None else scene
    views = tuple(look(scene, surface, side * yaw_deg / 2, camera) for side in (-1, 1))
    return views, (surface, surface), surface.focal_px * radians(yaw_deg)


def tilted(picture: np.ndarray, surface: Surface, turn: Attitude) -> np.ndarray:
    """Return the picture that a turn about one axis makes level again."""
    back = Attitude(-turn.yaw_rad, -turn.pitch_rad, -turn.roll_rad)
    return RemapTable(surface, surface, attitude=back)(picture)


def exposed(picture: np.ndarray, gain: float, noise: float, seed: int = 7) -> np.ndarray:
    """Return the picture as another camera takes it."""
    rng = np.random.default_rng(seed)
    return _seen_as(picture, picture * gain + rng.normal(0, noise, picture.shape))


def masked(picture: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Show values, of any range, where a picture shows something."""
    return _seen_as(picture, values)


def real_views(name: str, kind: str = 'cylindrical', turn: Attitude = LEVEL):
    """Return ((left, right) grey, surfaces) of a rig of real pictures, the right one turned."""
    folder = real_data('rigs') / name
    pictures, surfaces = [], []
    for side, attitude in (('left', LEVEL), ('right', turn)):
        camera = read_camera(folder / f'{side}.yaml').lens
        picture = cv2.imread(str(folder / f'{side}.png'), cv2.IMREAD_GRAYSCALE)
        circle = ImageCircle(camera)
        circle.look(picture)
        camera = camera.with_max_angle(circle.angle_rad)
        surface = surface_for(camera, kind)
        if surfaces:
            surface = surface.with_focal(surfaces[0].focal_px)
        surfaces.append(surface)
        pictures.append(View(camera, surface, attitude=attitude).corrected(picture))
    return tuple(pictures), tuple(surfaces)


def placed_at(views, *offsets, found: bool = True):
    """Place views whose corrected pictures lie at offsets (x, y), px, in the one before."""
    overlaps = [Overlap('true', found, float(x), float(y)) for x, y in offsets]
    return place(views_at_overlaps(views, overlaps))


def _in_range(values):
    return np.clip(np.rint(values), 1, 255).astype(np.uint8)


def _seen_as(picture, values):
    return np.where(picture > 0, _in_range(values), 0).astype(np.uint8)
