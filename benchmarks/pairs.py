"""Pairs of pictures whose cameras are known: of the synthetic rig, and of rigs in folders."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from pathlib import Path

import cv2
import numpy as np

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.camera_file import read_camera
from fisheye_geometry.image_circle import ImageCircle
from fisheye_geometry.lens import Lens
from fisheye_testing.data import DATA
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState

SIDES = ('left', 'right')
YAWS = radians(-70), radians(70)


@dataclass(frozen=True)
class ImagePair:
    """Two pictures (height, width, 3) uint8 BGR, from left to right, and their lenses."""

    name: str
    lenses: Sequence[Lens]
    images: Sequence[np.ndarray]
    is_synthetic: bool = False

    def stitcher(self, settings: PanoramaSettings) -> RigState:
        """Know the cameras, and the overlap: the true one of the synthetic rig, else measured."""
        stitcher = RigState(SIDES)
        for side, lens in zip(SIDES, self.lenses, strict=True):
            stitcher.place(side, lens, settings.surface_of(lens), settings.interpolation)
        if self.is_synthetic:
            offset_px = (YAWS[1] - YAWS[0]) * stitcher.surfaces[0].focal_px
            attitude = Attitude(yaw_rad=YAWS[1] - YAWS[0])
            stitcher.overlaps = [Overlap('true', True, offset_px, 0.0, attitude)]
        else:
            stitcher.overlaps = measure_overlaps(
                stitcher, [self.images], settings, settings.method
            )
        return stitcher


def synthetic_pair(width: int, height: int, gains: Sequence[float] = (1.0, 1.0)) -> ImagePair:
    """Photograph the synthetic world with two exposures."""
    lens = synthetic_lens(width, height, radians(170))
    images = [
        Scene().view(lens, Attitude(yaw_rad=yaw), gain).frame(0)
        for yaw, gain in zip(YAWS, gains, strict=True)
    ]
    return ImagePair('synthetic', [lens, lens], images, is_synthetic=True)


def folder_pair(folder: Path) -> ImagePair:
    """Read left and right .png and .yaml."""
    lenses, images = zip(*(read_view(folder, side) for side in SIDES), strict=True)
    return ImagePair(folder.name, lenses, images)


def read_view(folder: Path, name: str) -> tuple[Lens, np.ndarray]:
    """Read the lens of a camera, as far as its picture is lit, and the picture."""
    image, lens = (
        cv2.imread(str(folder / f'{name}.png')),
        read_camera(folder / f'{name}.yaml').lens,
    )
    circle = ImageCircle(lens)
    circle.look(image)
    return lens.with_max_angle(circle.angle_rad), image


def real_pairs() -> list[ImagePair]:
    """Read the rigs of `DATA` whose views overlap; none where the folder is absent."""
    return [
        folder_pair(path.parent)
        for path in sorted((DATA / 'rigs').glob('*/truth.json'))
        if json.loads(path.read_text())['overlaps']
    ]
