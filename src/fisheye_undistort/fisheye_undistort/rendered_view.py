"""A printed target as a fisheye lens sees it: pictures whose truth is known."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from fisheye_geometry.lens import Lens
from fisheye_undistort.target import Target
from fisheye_undistort.target_sheet import sheet_picture

_SHEET_PX_PER_MM = 4.0
_SUBPIXELS = 3
"""Rays per pixel in each direction: edges of the print become grey as on a sensor."""


@dataclass(frozen=True)
class Look:
    """What keeps a picture from being ideal, grey levels of 255 and px."""

    paper: float = 215.0
    ink: float = 25.0
    backdrop: float = 90.0
    light_falloff: float = 0.5
    """Share of the light that is lost from one side of the picture to the other."""
    blur_px: float = 0.8
    noise: float = 2.0


@dataclass(frozen=True)
class Pose:
    """Where the target is: its frame to the camera's, rotation (3, 3) and translation (3,) mm."""

    rotation: np.ndarray
    translation_mm: np.ndarray


def facing_pose(
    azimuth_rad: float, angle_rad: float, distance_mm: float, tilt_rad=(0.0, 0.0, 0.0)
) -> Pose:
    """Put the target's middle where a direction points, facing the camera but for a tilt.

    Parameters
    ----------
    azimuth_rad
        Direction about the optical axis, 0 to the right, clockwise as the camera sees it.
    angle_rad
        From the optical axis; beyond 90 degrees too.
    distance_mm
        From the camera to the target's middle.
    tilt_rad
        Rotation vector of the target about its own axes.
    """
    axis = angle_rad * np.array([-np.sin(azimuth_rad), np.cos(azimuth_rad), 0.0])
    facing = cv2.Rodrigues(axis)[0]
    rotation = facing @ cv2.Rodrigues(np.array(tilt_rad, float))[0]
    return Pose(rotation, facing @ (0.0, 0.0, distance_mm))


def render_view(lens: Lens, target: Target, pose: Pose, look: Look = Look(), seed=0) -> np.ndarray:
    """Photograph the printed sheet in front of a mottled backdrop.

    Returns
    -------
    ndarray
        (lens.height, lens.width) uint8.
    """
    random = np.random.default_rng(seed)
    rays, seen = _rays(lens)
    sheet, origin = _sheet(target)
    x, y, depth = np.moveaxis(rays @ pose.rotation, -1, 0)
    place = pose.rotation.T @ pose.translation_mm.astype(np.float32)
    with np.errstate(divide='ignore', invalid='ignore'):
        scale = np.where(depth * place[2] > 0, place[2] / depth, np.nan)
        where = [(c * scale - p) * _SHEET_PX_PER_MM + o for c, p, o in
                 zip((x, y), place, origin, strict=False)]
    where = [np.nan_to_num(c, nan=-1e4).clip(-1e4, 1e4).astype(np.float32) for c in where]
    print_ = cv2.remap(sheet, *where, cv2.INTER_LINEAR, borderValue=-1)
    fine = np.where(print_ >= 0, look.ink + (look.paper - look.ink) * print_, look.backdrop)
    fine = np.where(seen, fine, 0.0).astype(np.float32)
    picture = cv2.resize(fine, (lens.width, lens.height), interpolation=cv2.INTER_AREA)
    picture = _light(picture, look, random)
    picture = cv2.GaussianBlur(picture, (0, 0), look.blur_px) if look.blur_px else picture
    picture += random.normal(0.0, look.noise, picture.shape)
    return picture.round().clip(0, 255).astype(np.uint8)


def _light(picture, look, random):
    """Light that falls off across the picture, and a backdrop that is not plain."""
    height, width = picture.shape
    mottle = cv2.resize(random.normal(1.0, 0.3, (12, 16)), (width, height),
                        interpolation=cv2.INTER_CUBIC)
    picture = np.where(picture == look.backdrop, picture * mottle, picture)
    slope = np.linspace(1.0, 1.0 - look.light_falloff, width)
    return (picture * slope).astype(np.float32)


@lru_cache(maxsize=2)
def _rays(lens: Lens):
    """Rays (height * n, width * n, 3) float32 of every subpixel, and which are seen."""
    y, x = (
        (np.arange(size * _SUBPIXELS) + 0.5) / _SUBPIXELS - 0.5
        for size in (lens.height, lens.width)
    )
    rays, seen = lens.unproject(np.stack(np.meshgrid(x, y), axis=-1))
    return rays.astype(np.float32), seen


@lru_cache(maxsize=4)
def _sheet(target: Target):
    """The print, 0 for ink to 1 for paper, and the pixel of the target's origin."""
    picture, origin = sheet_picture(target, _SHEET_PX_PER_MM)
    return picture.astype(np.float32) / 255, origin
