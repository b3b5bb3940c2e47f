"""By how much a printed circle's centre of mass is seen beside its centre."""

import numpy as np

from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.sheet_model import pixels_of, to_camera, warp_board
from fisheye_undistort.target.target import Target

_RIM = np.linspace(0, 2 * np.pi, 32, endpoint=False)
"""Directions of the points that stand for a circle, rad."""


def center_bias(estimate: Estimate, views: list[TargetView], target: Target) -> list[np.ndarray]:
    """Centre of mass of each projected circle minus the projection of its centre, (N, 2) px.

    Perspective and the lens magnify the two halves of a circle differently, by a pixel and more
    where the circles are large.
    """
    rim = target.radius_mm * np.stack([np.cos(_RIM), np.sin(_RIM), 0 * _RIM], axis=-1)
    biases = []
    for pose, view in zip(estimate.poses, views, strict=True):
        centers = warp_board(target.points_mm, estimate.board_warp_mm)[view.ids]
        rims = to_camera(pose, centers[:, None] + rim)
        outline = pixels_of(estimate.unknowns, rims)
        middle = pixels_of(estimate.unknowns, to_camera(pose, centers))
        biases.append(_centroid(outline - middle[:, None]))
    return biases


def _centroid(polygons: np.ndarray) -> np.ndarray:
    """Centres of mass (N, 2) of polygons (N, K, 2)."""
    following = np.roll(polygons, -1, axis=1)
    cross = polygons[..., 0] * following[..., 1] - polygons[..., 1] * following[..., 0]
    weighted = np.sum((polygons + following) * cross[..., None], axis=1)
    return weighted / (3 * cross.sum(axis=1))[:, None]
