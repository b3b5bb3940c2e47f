"""The stitcher: views of the cameras, the overlaps between them, and the compositor they make."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan

import numpy as np

from fisheye_geometry.errors import ImageFormatError, OverlapError
from fisheye_geometry.lens import Lens
from fisheye_geometry.remap import LEVEL
from fisheye_geometry.surface import Surface
from panorama_stitch.compositor import BLENDS, Compositor
from panorama_stitch.gain import GainCompensation
from panorama_stitch.layout import lay_out
from panorama_stitch.overlap import Overlap, measure_overlap
from panorama_stitch.seam import settle_seams
from panorama_stitch.settings import PanoramaOutputSettings
from panorama_stitch.view import View

Group = Sequence[np.ndarray]
"""One picture of each camera, taken at the same time."""


class Stitcher:
    """Turns what is known of the cameras into something that composes panoramas.

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
        self._places: dict[int, tuple[Lens | Surface, Surface, str]] = {}

    @property
    def is_complete(self) -> bool:
        """Whether it is known what every camera sees."""
        return len(self._places) == len(self.cameras)

    @property
    def surfaces(self) -> list[Surface]:
        """What the corrected pictures show, all with the focal length of the first."""
        return [view.surface for view in self._views()]

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> bool:
        """Say what a camera's pictures show; whether that is news.

        Overlaps that were measured on other surfaces are forgotten.
        """
        place = source, surface, interpolation
        index = self.cameras.index(camera)
        former = self._places.get(index)
        if place == former:
            return False
        self._places[index] = place
        if former and former[1] != surface:
            self.overlaps = None
        return True

    def knows(self, camera: str) -> bool:
        """Whether it is known what a camera sees."""
        return self.cameras.index(camera) in self._places

    def check(self, camera: str, image: np.ndarray) -> None:
        """Raise an `ImageFormatError` for a picture of another size than the camera's."""
        place = self._places.get(self.cameras.index(camera))
        if place and image.shape[:2] != (place[0].height, place[0].width):
            raise ImageFormatError(
                f'the picture of {camera} has {image.shape[1]}x{image.shape[0]} px; '
                f'expected {place[0].width}x{place[0].height} px'
            )

    def black(self, camera: str, channels: tuple[int, ...]) -> np.ndarray:
        """Give a picture for a camera that never gave one, (height, width, *channels) uint8."""
        source = self._places[self.cameras.index(camera)][0]
        return np.zeros((source.height, source.width, *channels), np.uint8)

    def measure(
        self, groups: Sequence[Group], settings: PanoramaOutputSettings, method: str
    ) -> list[Overlap]:
        """Measure the overlap of each neighbouring pair on groups of pictures.

        Raises
        ------
        OverlapError
            If there is no group, or the pictures cannot be what the cameras are known to give.
        """
        if not groups:
            raise OverlapError('no pair of frames has come yet; are both cameras running?')
        views = self._views(groups[0])
        overlaps = []
        for i in range(len(views) - 1):
            pairs = [
                (views[i].corrected(group[i]), views[i + 1].corrected(group[i + 1]))
                for group in groups
            ]
            overlap = measure_overlap(
                pairs, views[i].surface, views[i + 1].surface, settings, method
            )
            views[i + 1] = replace(views[i + 1], turn=overlap.turn)
            overlaps.append(overlap)
        return overlaps

    def in_use(self, settings: PanoramaOutputSettings) -> list[Overlap]:
        """Give the overlaps with those set by hand in place of the measured ones.

        Raises
        ------
        OverlapError
            If a number was set by hand for a pair that does not exist.
        """
        pairs = len(self.cameras) - 1
        by_hand = [
            _one_per_pair(name, getattr(settings, name), pairs)
            for name in ('offset_x_px', 'offset_y_px')
        ]
        measured = self.overlaps or [side_by_side(s) for s in self.surfaces[:-1]]
        return [_set_by_hand(*entry) for entry in zip(measured, *by_hand, strict=True)]

    def compositor(self, settings: PanoramaOutputSettings, group: Group) -> Compositor:
        """Build what composes panoramas; `group` shows where pictures are black for good."""
        overlaps = self.in_use(settings)
        turns = [LEVEL, *(overlap.turn for overlap in overlaps)]
        views = [
            replace(view, turn=turn) for view, turn in zip(self._views(group), turns, strict=True)
        ]
        fade_px = np.radians(settings.feather_deg) * views[0].surface.focal_px
        fade_px *= BLENDS[settings.blend]
        layout = lay_out(
            views,
            [(overlap.offset_x_px, overlap.offset_y_px) for overlap in overlaps],
            fade_px=fade_px,
            crop=settings.crop if all(overlap.found for overlap in overlaps) else 'none',
        )
        layout = settle_seams(layout, views, group)
        gain = GainCompensation(layout, views, group) if settings.gain_compensation else None
        return Compositor(layout, views, settings.blend, gain)

    def _views(self, group: Group | None = None) -> list[View]:
        focal_px = self._places[0][1].focal_px
        views = []
        for index in range(len(self.cameras)):
            source, surface, interpolation = self._places[index]
            if surface.focal_px != focal_px:
                surface = surface.with_focal(focal_px)
            seen = None
            if group is not None:
                self.check(self.cameras[index], group[index])
            if group is not None and isinstance(source, Surface):
                seen = group[index] > 0 if group[index].ndim == 2 else group[index].any(axis=2)
            views.append(View(source, surface, interpolation, seen=seen))
        return views


def side_by_side(left: Surface) -> Overlap:
    """Give the answer where nothing was measured: both frames whole, the right beside the left."""
    return Overlap(method='', found=False, offset_x_px=float(left.width), offset_y_px=0.0)


def _one_per_pair(name: str, values: Sequence[float], pairs: int) -> Sequence[float]:
    if all(isnan(value) for value in values):
        return [float('nan')] * pairs
    if len(values) != pairs:
        raise OverlapError(
            f'{name} has {len(values)} numbers; expected {pairs}, one for each neighbouring pair'
        )
    return values


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
