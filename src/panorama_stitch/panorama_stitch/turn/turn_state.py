"""The model of a turn on the spot: a rig that rotates about one axis before landmarks.

The world is level and stands still: y is the axis of the turn, straight down. The rig's frame
turns in it, to the right by the angle of each frame. A camera is fixed in the rig, turned as its
attitude says and off the axis by its place. A landmark is a direction from the axis and how near
it is, so that what is infinitely far is as good as anything else.
"""

from dataclasses import dataclass, replace

import numpy as np

from fisheye_geometry.attitude import rotation_matrix
from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import INTRINSICS, lens_of, project
from panorama_stitch.turn.sightings import Sightings

OF_CAMERA = (*INTRINSICS, 'turn_x', 'turn_y', 'turn_z', 'place_x', 'place_y', 'place_z')
"""Unknowns of a camera: its lens, a small rotation of it in the rig, rad, and its place, m."""
WIDTH = len(OF_CAMERA)
_LENS, _TURN, _PLACE = np.split(np.arange(WIDTH), [len(INTRINSICS), len(INTRINSICS) + 3])
_AXIS = np.array([0.0, 1.0, 0.0])


@dataclass(frozen=True)
class TurnState:
    """All that a turn is explained with.

    Attributes
    ----------
    lenses
        (C, 8) in the order of `INTRINSICS`.
    attitudes
        (C, 3, 3) rotations of rays of each camera to rays of the rig.
    places
        (C, 3) of the cameras in the rig, from the axis, m.
    angles
        (T,) how far the rig had turned to the right in each frame, rad.
    directions
        (L, 3) unit vectors from the axis to the landmarks, in the world.
    nearness
        (L,) of the landmarks, 1/m: 0 for what is infinitely far.
    """

    lenses: np.ndarray
    attitudes: np.ndarray
    places: np.ndarray
    angles: np.ndarray
    directions: np.ndarray
    nearness: np.ndarray

    def lens(self, camera: int, size: tuple[int, int]) -> FisheyeLens:
        """Return a camera's lens for pictures of (width, height)."""
        return lens_of(self.lenses[camera], size)

    @property
    def rig_count(self) -> int:
        """Number of the unknowns that are not of landmarks."""
        return WIDTH * len(self.lenses) + len(self.angles)

    def off_axis(self, camera: int) -> float:
        """Return how far a camera is off the axis, in usual distances of landmarks."""
        return float(np.linalg.norm(self.places[camera]) * np.median(np.abs(self.nearness)))

    def moved(self, step: np.ndarray) -> 'TurnState':
        """Return the state after a step in all unknowns: cameras, angles, landmarks."""
        cameras, angles, landmarks = np.split(step, [WIDTH * len(self.lenses), self.rig_count])
        cameras, landmarks = cameras.reshape(-1, WIDTH), landmarks.reshape(-1, 3)
        turned = [
            rotation_matrix(turn) @ attitude
            for turn, attitude in zip(cameras[:, _TURN], self.attitudes, strict=True)
        ]
        moved = self.directions + np.einsum(
            'lij,lj->li', tangents(self.directions), landmarks[:, :2]
        )
        return replace(
            self,
            lenses=self.lenses + cameras[:, _LENS],
            attitudes=np.array(turned),
            places=self.places + cameras[:, _PLACE],
            angles=self.angles + angles,
            directions=moved / np.linalg.norm(moved, axis=1, keepdims=True),
            nearness=self.nearness + landmarks[:, 2],
        )

    def scaled(self, factor: float) -> 'TurnState':
        """Return the same rig before landmarks `factor` times as near: nothing looks different."""
        return replace(self, places=self.places / factor, nearness=self.nearness * factor)

    def rays(self, seen: Sightings) -> np.ndarray:
        """Return the ray (N, 3), of any length, at which each sighting should be."""
        in_rig = self._in_rig(seen.frame, self.directions[seen.landmark])
        ray = in_rig - self.nearness[seen.landmark, None] * self.places[seen.camera]
        return np.einsum('nji,nj->ni', self.attitudes[seen.camera], ray)

    def predict(self, seen: Sightings) -> np.ndarray:
        """Return the pixels (N, 2) at which each sighting should be."""
        rays, pixels = self.rays(seen), np.empty((len(seen), 2))
        for camera, lens in enumerate(self.lenses):
            mine = seen.camera == camera
            pixels[mine] = project(lens, rays[mine])[0]
        return pixels

    def derivatives(self, seen: Sightings) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return derivatives of `predict` by what `moved` changes.

        Returns
        -------
        by_camera : ndarray
            (N, 2, WIDTH) by the unknowns of the sighting's camera.
        by_angle : ndarray
            (N, 2, 1) by the angle of its frame.
        by_landmark : ndarray
            (N, 2, 3) by the direction along its `tangents` and the nearness of its landmark.
        """
        nearness = self.nearness[seen.landmark, None]
        back = self.attitudes[seen.camera].transpose(0, 2, 1)
        in_rig = self._in_rig(seen.frame, self.directions[seen.landmark])
        place = self.places[seen.camera]
        ray = in_rig - nearness * place
        rays = np.einsum('nij,nj->ni', back, ray)
        by_lens, by_ray = np.empty((len(seen), 2, len(_LENS))), np.empty((len(seen), 2, 3))
        for camera, lens in enumerate(self.lenses):
            mine = seen.camera == camera
            _, by_lens[mine], by_ray[mine] = project(lens, rays[mine])
        by_rig = by_ray @ back  # of a ray in the rig's frame
        by_turn = np.cross(by_rig, ray[:, None])
        by_place = -nearness[:, None] * by_rig
        by_angle = by_rig @ -np.cross(_AXIS, in_rig)[..., None]
        axes = tangents(self.directions)[seen.landmark].transpose(0, 2, 1)
        along = [self._in_rig(seen.frame, axes[:, i])[..., None] for i in range(2)]
        by_landmark = by_rig @ np.concatenate([*along, -place[..., None]], axis=-1)
        return np.concatenate([by_lens, by_turn, by_place], axis=-1), by_angle, by_landmark

    def _in_rig(self, frame: np.ndarray, world: np.ndarray) -> np.ndarray:
        return in_world(world, -self.angles[frame])


def in_world(vectors: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Return vectors (N, 3) of a rig that has turned to the right by angles (N,) in the world."""
    cos, sin = np.cos(angles_rad), np.sin(angles_rad)
    x, y, z = vectors.T
    return np.stack([cos * x + sin * z, y, cos * z - sin * x], axis=-1)


def tangents(directions: np.ndarray) -> np.ndarray:
    """Return two axes across each direction (L, 3), as columns (L, 3, 2)."""
    x, y, z = directions.T
    flat = np.stack([z, 0 * y, -x], axis=-1)
    steep = np.abs(y) > 0.999
    flat[steep] = np.stack([0 * x, -z, y], axis=-1)[steep]
    flat /= np.linalg.norm(flat, axis=1, keepdims=True)
    return np.stack([flat, np.cross(directions, flat)], axis=-1)
