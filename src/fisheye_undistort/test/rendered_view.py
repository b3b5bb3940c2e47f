"""A printed target as a fisheye lens sees it: pictures whose truth is known."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.lens import Lens
from fisheye_undistort.target.target import Target
from fisheye_undistort.target.target_sheet import sheet_picture

_SHEET_PX_PER_MM = 4.0
_SUBPIXELS = 3
"""Rays per pixel in each direction: edges of the print become grey as on a sensor."""


_NO_SHEET = -10.0
_TRIES = 200


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
class TargetPose:
    """Where the target is: its frame to the camera's, rotation (3, 3) and translation (3,) mm."""

    rotation: np.ndarray
    translation_mm: np.ndarray


def facing_pose(
    azimuth_rad: float, angle_rad: float, distance_mm: float, tilt_rad=(0.0, 0.0, 0.0)
) -> TargetPose:
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
    return TargetPose(rotation, facing @ (0.0, 0.0, distance_mm))


def scattered_poses(
    lens: Lens, target: Target, count: int, distance_mm: tuple[float, float], seed: int = 0
) -> list[TargetPose]:
    """Poses all over the picture in which a lens sees the whole pattern, tilted at random."""
    random = np.random.default_rng(seed)
    reach = np.abs(target.points_mm).max(axis=0) + target.radius_mm
    outline = np.linspace(-1, 1, 9)
    outline = np.stack(np.meshgrid(outline, outline, 0.0), axis=-1).reshape(-1, 3) * reach
    last = np.array([lens.width - 1, lens.height - 1])
    poses = []
    for _ in range(_TRIES * count):
        tilt = random.uniform((-0.6, -0.6, -3), (0.6, 0.6, 3))
        pose = facing_pose(
            random.uniform(0, 2 * np.pi),
            random.uniform(0, 1.4),
            random.uniform(*distance_mm),
            tilt,
        )
        pixels, seen = lens.project(outline @ pose.rotation.T + pose.translation_mm)
        if seen.all() and np.all((pixels > 1) & (pixels < last - 1)):
            poses.append(pose)
        if len(poses) == count:
            return poses
    raise GeometryError(f'the lens sees the whole {target} too seldom from {distance_mm} mm')


def render_view(
    lens: Lens, target: Target, pose: TargetPose, look: Look = Look(), seed=0
) -> np.ndarray:
    """Photograph the printed sheet in front of a mottled backdrop.

    Returns
    -------
    ndarray
        (lens.height, lens.width) uint8.
    """
    random = np.random.default_rng(seed)
    lit = _lit(lens)
    picture = lit * look.backdrop * _mottle(lit.shape, random)
    top, bottom, left, right = _window(lens, target, pose)
    if top < bottom and left < right:
        y, x = (
            np.arange(*edge, 1 / _SUBPIXELS) + (1 / _SUBPIXELS - 1) / 2
            for edge in ((top, bottom), (left, right))
        )
        rays, seen = lens.unproject(np.stack(np.meshgrid(x, y), axis=-1))
        ink, covered = _sheet_seen(rays, seen, target, pose)
        sheet = look.ink * ink + look.paper * (covered - ink)
        window = picture[top:bottom, left:right]
        window[:] = window * (1 - covered) + sheet
    picture *= np.linspace(1.0, 1.0 - look.light_falloff, lens.width)
    picture = cv2.GaussianBlur(picture, (0, 0), look.blur_px) if look.blur_px else picture
    picture += random.normal(0.0, look.noise, picture.shape)
    return picture.round().clip(0, 255).astype(np.uint8)


def _mottle(shape: tuple[int, int], random) -> np.ndarray:
    """Return a backdrop that is not plain, around 1."""
    return cv2.resize(
        random.normal(1.0, 0.3, (12, 16)), shape[::-1], interpolation=cv2.INTER_CUBIC
    )


def _window(lens: Lens, target: Target, pose: TargetPose) -> tuple[int, int, int, int]:
    """Rows and columns of the picture that hold the sheet: top, bottom, left, right."""
    sheet, origin = _sheet(target)
    height, width = sheet.shape
    along, zero = np.linspace(0, 1, 50), np.zeros(50)
    x = np.concatenate([along, along, zero, zero + 1]) * width
    y = np.concatenate([zero, zero + 1, along, along]) * height
    edge = (np.stack([x, y], axis=-1) - origin) / _SHEET_PX_PER_MM
    edge = np.concatenate([edge, np.zeros((len(edge), 1))], axis=-1)
    pixels, seen = lens.project(edge @ pose.rotation.T + pose.translation_mm)
    if not seen.all():
        return 0, lens.height, 0, lens.width
    limits = np.array([lens.width, lens.height])
    first = (np.floor(pixels.min(axis=0)).astype(int) - 1).clip(0, limits)
    last = (np.ceil(pixels.max(axis=0)).astype(int) + 2).clip(0, limits)
    return first[1], last[1], first[0], last[0]


def _sheet_seen(rays, seen, target: Target, pose: TargetPose) -> tuple[np.ndarray, np.ndarray]:
    """Shares of ink and of sheet in each pixel, from rays (rows * n, columns * n, 3)."""
    sheet, origin = _sheet(target)
    x, y, depth = np.moveaxis(rays @ pose.rotation, -1, 0)
    place = pose.rotation.T @ pose.translation_mm
    scale = np.divide(place[2], depth, out=np.full_like(depth, -1), where=depth * place[2] > 0)
    where = [
        ((axis * scale - start) * _SHEET_PX_PER_MM + middle).clip(-9, 32000).astype(np.float32)
        for axis, start, middle in zip((x, y), place, origin, strict=False)
    ]
    print_ = cv2.remap(sheet, *where, cv2.INTER_LINEAR, borderValue=_NO_SHEET)
    covered = (print_ > _NO_SHEET / 2) & (scale > 0) & seen
    size = (x.shape[1] // _SUBPIXELS, x.shape[0] // _SUBPIXELS)
    return tuple(
        cv2.resize(share.astype(np.float32), size, interpolation=cv2.INTER_AREA)
        for share in (np.where(covered, 1 - print_.clip(0), 0), covered)
    )


@lru_cache(maxsize=4)
def _lit(lens: Lens) -> np.ndarray:
    """Mark the pixels (height, width) that the lens lights, 1 or 0."""
    return lens.unproject(
        np.stack(np.meshgrid(np.arange(lens.width), np.arange(lens.height)), axis=-1)
    )[1].astype(float)


@lru_cache(maxsize=4)
def _sheet(target: Target) -> tuple[np.ndarray, np.ndarray]:
    """The print, 0 for ink to 1 for paper, and the pixel of the target's origin."""
    picture, origin = sheet_picture(target, _SHEET_PX_PER_MM)
    return picture.astype(np.float32) / 255, origin
