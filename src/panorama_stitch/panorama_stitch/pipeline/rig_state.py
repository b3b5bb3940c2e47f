"""What is known of the rig: what each camera shows and the overlaps between neighbours."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan, nan
from threading import Lock
from typing import NamedTuple

import numpy as np

from fisheye_core.errors import ImageFormatError, OverlapError
from fisheye_geometry.lens import Lens
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.posing import views_at_overlaps
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.measure_overlap import measure_overlap
from panorama_stitch.overlap.overlap_result import Overlap, side_by_side
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

Images = Sequence[np.ndarray]
"""One image of each camera, taken at the same time."""


class RigState:
    """What each camera shows, the overlaps between neighbours, and the compositor that follows.

    Attributes
    ----------
    cameras
        Names from left to right.
    overlaps
        One for each neighbouring pair as measured or read; None before.
    """

    def __init__(self, cameras: Sequence[str]):
        self.cameras = tuple(cameras)
        self.overlaps: list[Overlap] | None = None
        self._places: dict[int, _Place] = {}
        self._lock = Lock()

    @property
    def is_complete(self) -> bool:
        """Whether it is known what every camera sees."""
        return len(self._places) == len(self.cameras)

    @property
    def surfaces(self) -> list[Surface]:
        """What the corrected images show, all with the focal length of the first."""
        return [surface for _, surface in sorted(_with_one_focal(self._places).items())]

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> bool:
        """Set what a camera's images show; return whether that is news.

        Overlaps that were measured on other surfaces are forgotten.

        Raises
        ------
        GeometryError
            If there is no surface with the focal length of the first camera; the former place
            stays.
        """
        index, place = self.cameras.index(camera), _Place(source, surface, interpolation)
        former = self._places.get(index)
        if place == former:
            return False
        _with_one_focal({**self._places, index: place})
        with self._lock:
            self._places[index] = place
            if former and former.surface != surface:
                self.overlaps = None
        return True

    def set_overlaps(self, overlaps: list[Overlap], surfaces: list[Surface]) -> bool:
        """Use overlaps if the surfaces that they were measured on are still in use; whether so."""
        with self._lock:
            is_current = surfaces == self.surfaces
            if is_current:
                self.overlaps = overlaps
        return is_current

    def has_camera(self, camera: str) -> bool:
        """Whether it is known what a camera sees."""
        return self.cameras.index(camera) in self._places

    def check(self, camera: str, image: np.ndarray) -> None:
        """Raise an `ImageFormatError` for a image of another size than the camera's."""
        place = self._places.get(self.cameras.index(camera))
        if place and image.shape[:2] != (place.source.height, place.source.width):
            raise ImageFormatError(
                f'the image of {camera} has {image.shape[1]}x{image.shape[0]} px; '
                f'expected {place.source.width}x{place.source.height} px'
            )

    def black(self, camera: str, channels: tuple[int, ...]) -> np.ndarray:
        """Return a image for a camera that never gave one, (height, width, *channels) uint8."""
        source = self._places[self.cameras.index(camera)].source
        return np.zeros((source.height, source.width, *channels), np.uint8)

    def measure(
        self, frame_sets: Sequence[Images], settings: PanoramaOutputSettings, method: str
    ) -> list[Overlap]:
        """Measure the overlap of each neighbouring pair.

        Parameters
        ----------
        frame_sets
            Images (height, width[, channels]) uint8, one of each camera in each set.
        settings
            How to measure.
        method
            One of `METHODS`, in place of the settings' own.

        Raises
        ------
        OverlapError
            If there is no frame set.
        ImageFormatError
            If the images cannot be what the cameras are known to give.
        """
        if not frame_sets:
            raise OverlapError('no pair of frames has come yet; are all cameras running?')
        views = self._views(frame_sets[0])
        overlaps = []
        for i in range(len(views) - 1):
            pairs = [
                (views[i].corrected(images[i]), views[i + 1].corrected(images[i + 1]))
                for images in frame_sets
            ]
            overlap = measure_overlap(
                pairs, views[i].surface, views[i + 1].surface, settings, method
            )
            views[i + 1] = replace(views[i + 1], attitude=overlap.turn)
            overlaps.append(overlap)
        return overlaps

    def effective_overlaps(self, settings: PanoramaOutputSettings) -> list[Overlap]:
        """Return the overlaps, with what was set by hand in place of what was measured."""
        pairs = len(self.cameras) - 1
        by_hand = [
            [nan] * pairs if all(map(isnan, values)) else values
            for values in (settings.offset_x_px, settings.offset_y_px)
        ]
        measured = self.overlaps or [
            side_by_side(surface, '', 'not measured yet') for surface in self.surfaces[:-1]
        ]
        return [_set_by_hand(*entry) for entry in zip(measured, *by_hand, strict=True)]

    def compositor(self, settings: PanoramaOutputSettings, images: Images) -> Compositor:
        """Build what composes panoramas.

        Parameters
        ----------
        settings
            How to compose.
        images
            One of each camera, (height, width[, channels]) uint8: they show where corrected
            images are black for good, where the seams fit best, and how bright they are.

        Raises
        ------
        ImageFormatError
            If a image cannot be what its camera is known to give.
        GeometryError
            If the surfaces cannot be joined.
        """
        overlaps = self.effective_overlaps(settings)
        is_found = all(overlap.found for overlap in overlaps)
        style = Style(
            blend=settings.blend,
            fade_rad=np.radians(settings.feather_deg),
            crop=settings.crop if is_found else 'none',
            is_gain_compensated=settings.gain_compensation,
        )
        return build_compositor(views_at_overlaps(self._views(images), overlaps), images, style)

    def _views(self, images: Images) -> list[View]:
        views = []
        for index, surface in sorted(_with_one_focal(self._places).items()):
            image, place = images[index], self._places[index]
            self.check(self.cameras[index], image)
            seen = None
            if isinstance(place.source, Surface):
                seen = image > 0 if image.ndim == 2 else image.any(axis=2)
            views.append(View(place.source, surface, place.interpolation, seen=seen))
        return views


class _Place(NamedTuple):
    """What a camera's images show, and how they are drawn on which surface."""

    source: Lens | Surface
    surface: Surface
    interpolation: str


def _with_one_focal(places: dict[int, _Place]) -> dict[int, Surface]:
    """Return the surface of each place, enlarged or reduced to the focal length of the first."""
    surfaces = {index: place.surface for index, place in places.items()}
    if 0 not in surfaces:
        return surfaces
    focal_px = surfaces[0].focal_px
    return {
        index: surface if surface.focal_px == focal_px else surface.with_focal(focal_px)
        for index, surface in surfaces.items()
    }


def _set_by_hand(measured: Overlap, x_px: float, y_px: float) -> Overlap:
    if isnan(x_px) and isnan(y_px):
        return measured
    return replace(
        measured,
        method='manual',
        found=measured.found or not isnan(x_px),
        offset_x_px=measured.offset_x_px if isnan(x_px) else x_px,
        offset_y_px=measured.offset_y_px if isnan(y_px) else y_px,
        message='set by hand',
    )
