"""What is known of the rig, overlaps included, and the compositor that follows."""

from collections.abc import Sequence
from math import isnan, nan

import numpy as np

from fisheye_geometry.lens import Lens
from fisheye_geometry.rig import Pair, pairs_for
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.placing import leads_around
from panorama_stitch.compose.posing import views_at_overlaps, views_of_rig
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.overlap_result import (
    Overlap,
    overlap_by_hand,
    side_by_side,
)
from panorama_stitch.pipeline.known_cameras import Images
from panorama_stitch.pipeline.mounted_cameras import MountedCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings


class RigState(MountedCameras):
    """Mounted cameras, the overlaps between neighbours, and the compositor that follows.

    Attributes
    ----------
    overlaps
        One for each of `pairs` as measured or read; None before.
    """

    overlaps: list[Overlap] | None = None

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Neighbours, the closing pair of a ring last; one for each of the overlaps."""
        return pairs_for(len(self.cameras), len(self.overlaps or ()))

    def place(
        self, camera: str, source: Lens | Surface, surface: Surface, interpolation: str = 'linear'
    ) -> bool:
        """Set what a camera's images show, as `KnownCameras`.

        Overlaps that were measured on other surfaces are forgotten.
        """
        former = self.places.get(self.cameras.index(camera))
        is_news = super().place(camera, source, surface, interpolation)
        if former and former.surface != surface:
            with self._lock:
                self.overlaps = None
        return is_news

    def set_overlaps(self, overlaps: list[Overlap], surfaces: list[Surface]) -> bool:
        """Use overlaps if the surfaces that they were measured on are still in use; whether so."""
        with self._lock:
            is_current = surfaces == self.surfaces
            if is_current:
                self.overlaps = overlaps
        return is_current

    def effective_overlaps(self, settings: PanoramaOutputSettings) -> list[Overlap]:
        """Return the overlaps, with what was set by hand in place of what was measured."""
        surfaces, pairs = self.surfaces, self.pairs
        measured = self.overlaps or [
            side_by_side(surfaces[pair.left], '', 'not measured yet') for pair in pairs
        ]
        by_hand = [
            [*values, *[nan] * len(pairs)][: len(pairs)]
            if not all(map(isnan, values))
            else [nan] * len(pairs)
            for values in (settings.offset_x_px, settings.offset_y_px)
        ]
        if np.isnan(by_hand).all():
            return list(measured)
        # What is set by hand must not change when the robot stands on another slope.
        level = 'symmetric' if settings.level == 'imu' else settings.level
        rig = self.solve(measured, settings, level=level).rig
        return [
            overlap_by_hand(
                overlap,
                x_px,
                y_px,
                surfaces[pair.left],
                surfaces[pair.right],
                rig.attitudes(pair),
            )
            for overlap, pair, x_px, y_px in zip(measured, pairs, *by_hand, strict=True)
        ]

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
            If an image cannot be what its camera is known to give.
        GeometryError
            If the surfaces cannot be joined.
        """
        overlaps = self.effective_overlaps(settings)
        views, wraps, is_whole = self._views(overlaps, settings, images)
        style = Style(
            blend=settings.blend,
            fade_rad=np.radians(settings.feather_deg),
            crop=settings.crop if is_whole else 'none',
            is_gain_compensated=settings.gain_compensation,
        )
        return build_compositor(views, images, style, wraps=wraps)

    def _views(
        self, overlaps: Sequence[Overlap], settings: PanoramaOutputSettings, images: Images
    ) -> tuple[list[View], bool, bool]:
        """Return the views of all cameras, whether they lead all around, and whether all fit."""
        surfaces, places = self.surfaces, [self.places[i] for i in range(len(self.cameras))]
        seen: list[np.ndarray | None] = []
        for camera, place, image in zip(self.cameras, places, images, strict=True):
            self.check(camera, image)
            if not isinstance(place.source, Surface):
                seen.append(None)
            else:
                seen.append(image > 0 if image.ndim == 2 else np.asarray(image.any(axis=2)))
        if not surfaces[0].yaw_is_column_shift:
            level = [
                View(place.source, surface, place.interpolation, seen=shows, body=body)
                for place, surface, shows, body in zip(
                    places, surfaces, seen, self.bodies, strict=True
                )
            ]
            views = views_at_overlaps(level, overlaps[: len(level) - 1])
            return views, False, all(overlap.found for overlap in overlaps)
        rig = self.solution(overlaps, settings).rig
        views = views_of_rig(
            rig,
            surfaces,
            interpolation=places[0].interpolation,
            seen=seen,
            bodies=self.bodies,
        )
        wraps = settings.ring != 'open' and not rig.apart and leads_around(views)
        return views, wraps, not rig.apart
