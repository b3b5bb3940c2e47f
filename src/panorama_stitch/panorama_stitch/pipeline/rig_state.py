"""What is known of the rig, overlaps included, and the compositor that follows."""

from collections.abc import Sequence
from math import isnan, nan

import numpy as np

from fisheye_geometry.rig import Pair, pairs_for
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.placing import leads_around
from panorama_stitch.compose.posing import views_at_overlaps, views_of_rig
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.overlap_by_hand import overlap_by_hand
from panorama_stitch.overlap.overlap_result import (
    Overlap,
    on_surfaces,
    side_by_side,
)
from panorama_stitch.pipeline.known_cameras import CameraPlace, Images, surfaces_of
from panorama_stitch.pipeline.mounted_cameras import MountedCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings


class RigState(MountedCameras):
    """Mounted cameras, the overlaps between neighbours, and the compositor that follows."""

    _measured: tuple[list[Overlap] | None, dict[int, CameraPlace]] = None, {}

    @property
    def overlaps(self) -> list[Overlap] | None:
        """One for each of `pairs` as measured or read; None before.

        Where only another part of what the same cameras see is shown, as when the image circle of
        a lens turns out to be larger, rotations stay and their offsets follow; else they are
        forgotten.
        """
        overlaps, places = self._measured
        return overlaps and self._as_shown_now(overlaps, places)

    @overlaps.setter
    def overlaps(self, overlaps: list[Overlap] | None) -> None:
        self._measured = overlaps, dict(self.places)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Neighbours, the closing pair of a ring last; one for each of the overlaps."""
        return pairs_for(len(self.cameras), len(self.overlaps or ()))

    def set_overlaps(self, overlaps: list[Overlap], surfaces: list[Surface]) -> bool:
        """Use overlaps if the surfaces that they were measured on are still in use; whether so."""
        with self._lock:
            is_current = surfaces == self.surfaces
            if is_current:
                self.overlaps = overlaps
        return is_current

    def inherit(self, former: 'RigState') -> bool:
        """Use the overlaps of another rig if they hold for what is shown here; whether so."""
        overlaps, places = former._measured
        is_current = bool(overlaps and self._as_shown_now(overlaps, places))
        if is_current:
            self._measured = overlaps, places
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

    def _as_shown_now(
        self, overlaps: list[Overlap], places: dict[int, CameraPlace]
    ) -> list[Overlap] | None:
        """Return overlaps with their offsets on what is in use; None where they do not hold."""
        then, now = surfaces_of(places), self.surfaces
        if then == now:
            return overlaps
        found = [overlap for overlap in overlaps if overlap.found]
        if (
            not found
            or not all(overlap.attitude for overlap in found)
            or places.keys() != self.places.keys()
            or not all(place.is_crop_of(places[index]) for index, place in self.places.items())
        ):
            return None
        pairs = pairs_for(len(self.cameras), len(overlaps))
        return [
            on_surfaces(
                overlap, (then[pair.left], then[pair.right]), (now[pair.left], now[pair.right])
            )
            for overlap, pair in zip(overlaps, pairs, strict=True)
        ]

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
