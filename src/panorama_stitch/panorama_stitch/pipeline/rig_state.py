"""What is known of the rig: what each camera shows, how it is mounted, and what was measured."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan, nan, radians

import numpy as np

from fisheye_core.errors import OverlapError
from fisheye_geometry.attitude import Attitude, rotation_matrix
from fisheye_geometry.lens import Lens
from fisheye_geometry.level import Mount
from fisheye_geometry.rig import Pair, pairs_of, unwrapped
from fisheye_geometry.rig_solution import RigSolution, solve_rig
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.placing import leads_around
from panorama_stitch.compose.posing import views_at_overlaps, views_of_rig
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.methods import METHODS, PairInput
from panorama_stitch.overlap.overlap_result import (
    Overlap,
    overlap_by_hand,
    side_by_side,
    with_offset,
)
from panorama_stitch.pipeline.known_cameras import KnownCameras
from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

Images = Sequence[np.ndarray]
"""One image of each camera, taken at the same time."""

_MOUNT_RAD, _YAW_MOUNT_RAD = radians(20.0), radians(60.0)
"""How far a rotation may be from what mounts say: all three angles of both, or their yaw only."""
_MOST_SETS, _FEWEST_SETS = 6, 2
"""Frame sets that one pair, and each of many pairs, is measured on."""
_CLOSING_RAD = radians(10.0)
"""How far the closing rotation of a ring may be from what the others leave for it."""


class RigState(KnownCameras):
    """What each camera shows, the overlaps between neighbours, and the compositor that follows.

    Attributes
    ----------
    overlaps
        One for each of `pairs` as measured or read; None before.
    gravity
        Where things fall in the frame of the robot, (3,) with x right, y down, z ahead; None
        while that is not known.
    """

    def __init__(
        self,
        cameras: Sequence[str],
        mounts: Sequence[Mount] = (),
        mask_files: Sequence[str] = (),
    ):
        """Start with what is known before anything is seen.

        Parameters
        ----------
        cameras
            Names from left to right.
        mounts
            What is known of how each is mounted; () for nothing.
        mask_files
            Of each the image that is white where it sees the robot itself; '' for none, () for
            none of them.
        """
        super().__init__(cameras, mask_files)
        self.overlaps: list[Overlap] | None = None
        self.gravity: np.ndarray | None = None
        self._mounts = tuple(mounts) or (Mount(),) * len(self.cameras)

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Neighbours, the closing pair of a ring last; one for each of the overlaps."""
        is_closed = self.overlaps is not None and len(self.overlaps) == len(self.cameras) > 1
        return pairs_of(len(self.cameras), is_closed)

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

    def measure(
        self, frame_sets: Sequence[Images], settings: PanoramaOutputSettings, method: str
    ) -> list[Overlap]:
        """Measure the overlap of each pair of neighbours, the closing one of a ring too.

        Parameters
        ----------
        frame_sets
            Images (height, width[, channels]) uint8, one of each camera in each set.
        settings
            How to measure.
        method
            One of `METHODS`, in place of the settings' own.

        Returns
        -------
        list of Overlap
            One for each pair; if the rig leads all around one for the closing pair too.

        Raises
        ------
        OverlapError
            If there is no frame set.
        ImageFormatError
            If the images cannot be what the cameras are known to give.
        """
        if not frame_sets:
            raise OverlapError('no pair of frames has come yet; are all cameras running?')
        for images in frame_sets:
            for camera, image in zip(self.cameras, images, strict=True):
                self.check(camera, image)
        measure = METHODS[method]
        # Many pairs are measured on fewer frame sets each: whoever asked waits for all.
        frame_sets = frame_sets[-max(_FEWEST_SETS, _MOST_SETS // (len(self.cameras) - 1 or 1)) :]
        overlaps = [
            measure(self._pair_input(pair, frame_sets), settings)
            for pair in pairs_of(len(self.cameras))
        ]
        closing = self._closing(overlaps, settings)
        if closing:
            first = replace(self._pair_input(closing[0], frame_sets), **closing[1])
            overlaps.append(measure(first, settings))
        return self._with_offsets(overlaps, settings)

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
        return [
            overlap_by_hand(overlap, x_px, y_px, surfaces[pair.left], surfaces[pair.right])
            for overlap, pair, x_px, y_px in zip(measured, pairs, *by_hand, strict=True)
        ]

    def solution(
        self, overlaps: Sequence[Overlap], settings: PanoramaOutputSettings
    ) -> RigSolution:
        """Return the rig that overlaps, mounts and level make; see `solve_rig`."""
        extra = Attitude(
            *(radians(getattr(settings, f'level_{name}_deg')) for name in ('yaw', 'pitch', 'roll'))
        )
        how, gravity = settings.level, None
        if how == 'imu' and self.gravity is None:
            how = 'symmetric'
        elif how == 'imu':
            # What the imu feels is in the robot's frame, in which the mounts are symmetric.
            robot = self._solve(overlaps, settings, level='symmetric').rig
            gravity = robot.cameras[0].attitude.matrix.T @ self.gravity
        return self._solve(overlaps, settings, level=how, gravity=gravity, extra=extra)

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

    def _solve(self, overlaps, settings, **how) -> RigSolution:
        count = len(self.cameras)
        rotations = [_rotation(overlap, settings) for overlap in overlaps]
        return solve_rig(
            [(name, self.places[i].source) for i, name in enumerate(self.cameras)],
            rotations[: count - 1],
            closing=rotations[count - 1] if len(rotations) == count else None,
            mounts=self._mounts,
            ring=settings.ring,
            **how,
        )

    def _pair_input(self, pair: Pair, frame_sets: Sequence[Images]) -> PairInput:
        views = self.camera_views
        left, right = views[pair.left], views[pair.right]
        images = [(each[pair.left], each[pair.right]) for each in frame_sets]
        one, other = self._mounts[pair.left], self._mounts[pair.right]
        if one.is_known and other.is_known:
            expected = Attitude.of(one.attitude.matrix.T @ other.attitude.matrix)
            return PairInput(left, right, images, expected, _MOUNT_RAD)
        if not (isnan(one.yaw_rad) or isnan(other.yaw_rad)):
            expected = Attitude(yaw_rad=other.yaw_rad - one.yaw_rad)
            return PairInput(left, right, images, expected, _YAW_MOUNT_RAD)
        return PairInput(left, right, images)

    def _closing(
        self, overlaps: list[Overlap], settings: PanoramaOutputSettings
    ) -> tuple[Pair, dict] | None:
        """Return the pair that closes the ring and where its rotation is expected, if one does."""
        count, surfaces = len(self.cameras), self.surfaces
        if count < 2 or settings.ring == 'open' or not surfaces[0].yaw_is_column_shift:
            return None
        pair = pairs_of(count, is_closed=True)[-1]
        if not all(overlap.found and overlap.attitude for overlap in overlaps):
            return (pair, {}) if settings.ring == 'closed' else None
        closed = replace(settings, ring='closed')
        rig = self._solve(overlaps, closed, level='symmetric').rig
        if not leads_around(views_of_rig(rig, surfaces)):
            return (pair, {}) if settings.ring == 'closed' else None
        return pair, {'expected': rig.relative(pair), 'within_rad': _CLOSING_RAD}

    def _with_offsets(
        self, overlaps: list[Overlap], settings: PanoramaOutputSettings
    ) -> list[Overlap]:
        """Return overlaps with the offsets that their rotations mean once the rig is level."""
        surfaces = self.surfaces
        rig = self.solution(overlaps, settings).rig
        result = []
        for overlap, pair in zip(
            overlaps, pairs_of(len(self.cameras), len(overlaps) == len(self.cameras)), strict=True
        ):
            left, right = (rig.cameras[i].attitude for i in pair)
            yaw_rad = unwrapped([left.yaw_rad, right.yaw_rad])[1]
            attitudes = left, replace(right, yaw_rad=yaw_rad)
            result.append(
                with_offset(overlap, surfaces[pair.left], surfaces[pair.right], attitudes)
            )
        return result


def _rotation(overlap: Overlap, settings: PanoramaOutputSettings) -> np.ndarray | None:
    """Return the rotation (3, 3) of right rays to left ones to be drawn with; None if unknown.

    Lenses that are apart see near things turned towards each other: at a distance the views agree
    where the right one is turned by baseline / distance about the normal of both axes.
    """
    if not overlap.found or overlap.attitude is None:
        return None
    matrix, distance_m = overlap.attitude.matrix, settings.align_distance_m
    if not (settings.baseline_m and distance_m):
        return matrix
    axis = np.cross((0.0, 0.0, 1.0), matrix[:, 2])
    angle_rad = settings.baseline_m / distance_m
    return rotation_matrix(axis / np.linalg.norm(axis) * angle_rad) @ matrix
