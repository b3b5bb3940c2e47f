"""Level pictures of a turn: equirectangular, so that a turn is a shift of columns."""

from collections.abc import Sequence

import cv2
import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.surface import Surface
from panorama_stitch.turn.corners import lit
from panorama_stitch.turn.patches import HALF_PX, find_patch, zoomed
from panorama_stitch.turn.sightings import Sightings
from panorama_stitch.turn.turn_state import TurnState

_DENSITY = 260.0
"""Pixels per radian that are enough."""
_HIGHEST_RAD = np.radians(62)
"""Above and below, columns are too narrow."""
_STEPS_AROUND = 720


class LevelViews:
    """What each camera saw in each frame, as it is level by an estimate of the turn."""

    def __init__(
        self,
        frames: Sequence[tuple[np.ndarray, ...]],
        state: TurnState,
        brightest: Sequence[np.ndarray],
    ):
        """Level the frames.

        Parameters
        ----------
        frames
            One (height, width) uint8 a camera.
        state
            The estimate.
        brightest
            (height, width) uint8 of each camera: the brightest that each pixel was.
        """
        self._state = state
        self._surface = _surface(state.lenses[:, 0].max())
        self._pictures: list[list[np.ndarray]] = []
        self._valid: list[np.ndarray] = []
        for camera, attitude in enumerate(state.attitudes):
            height, width = frames[0][camera].shape
            lens = state.lens(camera, (width, height))
            table = RemapTable(lens, self._surface, 'cubic', Attitude.of(attitude))
            self._pictures.append([table(pictures[camera]) for pictures in frames])
            self._valid.append(table(lit(brightest[camera]) * np.uint8(255)))

    def panorama(self, camera: int) -> np.ndarray:
        """Return all that a camera saw, (rows, _STEPS_AROUND) float32 local contrast."""
        total = np.zeros((self._surface.height // 4, _STEPS_AROUND), np.float32)
        weight = np.zeros_like(total)
        size = total.shape[::-1]
        for angle, picture in zip(self._state.angles, self._pictures[camera], strict=True):
            shift = round(angle / (2 * np.pi) * _STEPS_AROUND)
            small = cv2.resize(picture, size, interpolation=cv2.INTER_AREA)
            seen = cv2.resize(self._valid[camera], size, interpolation=cv2.INTER_AREA) > 250
            total += np.roll(np.where(seen, small, 0), shift, axis=1)
            weight += np.roll(seen.astype(np.float32), shift, axis=1)
        mean = total / np.maximum(weight, 1)
        detail = mean - cv2.GaussianBlur(mean, (0, 0), 12)
        return np.where(weight > 0, detail, 0)

    def find(
        self,
        seen: Sightings,
        reference: Sightings,
        reach_px: int,
        least: float,
        *,
        sheared: bool,
    ) -> Sightings:
        """Look for landmarks where they should be.

        Parameters
        ----------
        seen
            Which landmark to look for in which frame of which camera; its pixels do not count.
        reference
            One sighting of each landmark, in the order of their numbers: what it looks like.
        reach_px
            How far from where it should be, px of the level pictures.
        least
            Correlation from which on it is found.
        sheared
            Whether it may look sheared and stretched.

        Returns
        -------
        Sightings
            Those that were found.
        """
        place, looks_like = self._place(seen), self._surface.project(self._rays_of(reference))[0]
        distance = np.linalg.norm(self._state.rays(reference), axis=1)
        zoom = distance[seen.landmark] / np.linalg.norm(self._state.rays(seen), axis=1)
        found, keep = np.zeros((len(seen), 2)), np.zeros(len(seen), bool)
        for i, landmark in enumerate(seen.landmark):
            camera, frame = reference.camera[landmark], reference.frame[landmark]
            patch = zoomed(self._pictures[camera][frame], looks_like[landmark], zoom[i])
            picture = self._pictures[seen.camera[i]][seen.frame[i]]
            there = find_patch(picture, place[i], patch, reach_px, least, sheared=sheared)
            if there is not None:
                keep[i], found[i] = True, there
        return self._seen_at(seen.only(keep), found[keep])

    def visible(self, seen: Sightings) -> np.ndarray:
        """Return which sightings (N,) are well within what their camera shows."""
        place = self._place(seen)
        result = np.zeros(len(seen), bool)
        for camera, valid in enumerate(self._valid):
            inner = cv2.erode(
                valid, np.ones((2 * HALF_PX + 1,) * 2, np.uint8), borderType=cv2.BORDER_CONSTANT
            )
            mine = np.flatnonzero(seen.camera == camera)
            x, y = np.round(place[mine]).astype(int).T
            inside = (x >= 0) & (y >= 0) & (x < valid.shape[1]) & (y < valid.shape[0])
            result[mine[inside]] = inner[y[inside], x[inside]] > 250
        return result

    def _rays_of(self, seen):
        """Rays (N, 3) of the rig at which pixels were seen."""
        rays = np.empty((len(seen), 3))
        for camera, attitude in enumerate(self._state.attitudes):
            mine = seen.camera == camera
            lens = self._lens(camera)
            rays[mine] = lens.unproject(seen.pixels[mine])[0] @ attitude.T
        return rays

    def _lens(self, camera):
        return self._state.lens(camera, (16, 16))

    def _place(self, seen):
        """Where on the level pictures (N, 2) landmarks should be."""
        rays = np.einsum('nij,nj->ni', self._state.attitudes[seen.camera], self._state.rays(seen))
        return self._surface.project(rays)[0]

    def _seen_at(self, seen, place):
        rays = self._surface.rays(*place.T)
        pixels = np.empty((len(seen), 2))
        for camera, attitude in enumerate(self._state.attitudes):
            mine = seen.camera == camera
            pixels[mine] = self._lens(camera).project(rays[mine] @ attitude)[0]
        return Sightings(seen.camera, seen.frame, seen.landmark, pixels)


def _surface(focal: float) -> Surface:
    focal = min(focal, _DENSITY)
    width, height = round(2 * np.pi * focal), round(2 * _HIGHEST_RAD * focal)
    return Surface(
        'equirectangular', width, height, width / 2 / np.pi, (width - 1) / 2, (height - 1) / 2
    )
