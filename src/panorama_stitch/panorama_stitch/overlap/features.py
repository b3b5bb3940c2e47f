"""Features of a view, found on its stereographic picture.

A stereographic picture is conformal: however the camera is turned, a small part of the scene stays
similar to itself there, which is what SIFT is invariant to. So the features of a camera that is
tilted, on its side or upside down are those of a level one.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from panorama_stitch.overlap.view import OverlapView

_DENSITY = 170.0
"""Pixels per radian at the edge of the view; finer pictures tell no more."""
_WIDEST_RAD = np.radians(125)
_MOST = 900
_CONTRAST = 0.006
_NOISE = 4.0
"""Grey levels that count as contrast nowhere."""


@dataclass(frozen=True, eq=False)
class Features:
    """Features of one view.

    Attributes
    ----------
    frames
        (n, 3, 3): each feature's ray, the direction that it points in, and their cross product,
        as columns, in the optical frame.
    pixels
        (n, 2) px of the view's image.
    descriptors
        (n, 128) float32 of unit length.
    """

    frames: np.ndarray
    pixels: np.ndarray
    descriptors: np.ndarray


def find_features(view: OverlapView, usable: np.ndarray) -> Features:
    """Find the features of a view where `usable` (height, width) uint8 is not 0."""
    focal, half = _scale(view)
    side = 2 * half + 1
    rays = _rays(np.stack(np.meshgrid(np.arange(side), np.arange(side)), -1), focal, half)
    picture, valid = view.sample(rays, usable, 0.4 * view.density / _DENSITY)
    rows, columns = (np.flatnonzero(valid.any(axis=axis)) for axis in (1, 0))
    if not len(rows):
        return Features(np.zeros((0, 3, 3)), np.zeros((0, 2)), np.zeros((0, 128), np.float32))
    part = np.s_[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    valid = valid[part].astype(np.uint8)
    detector = cv2.SIFT_create(nfeatures=_MOST, contrastThreshold=_CONTRAST, edgeThreshold=20)
    keypoints, descriptors = detector.detectAndCompute(_even(picture[part], valid), valid)
    if not keypoints:
        return Features(np.zeros((0, 3, 3)), np.zeros((0, 2)), np.zeros((0, 128), np.float32))
    places = np.array([k.pt for k in keypoints]) + np.array([columns[0], rows[0]])
    angle = np.radians([k.angle for k in keypoints])
    ray = _rays(places, focal, half)
    ahead = _rays(places + 0.1 * np.stack([np.cos(angle), np.sin(angle)], -1), focal, half) - ray
    ahead -= ray * np.sum(ahead * ray, axis=1, keepdims=True)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    frames = np.stack([ray, ahead, np.cross(ray, ahead)], axis=-1)
    descriptors = np.sqrt(descriptors / np.maximum(descriptors.sum(axis=1, keepdims=True), 1e-6))
    return Features(frames, view.model.project(ray)[0], descriptors.astype(np.float32))


def _scale(view):
    """Pixels per radian in the centre, and pixels from there to the edge."""
    reach = min(view.reach_rad, _WIDEST_RAD)
    density = min(view.density, _DENSITY)
    focal = density * np.cos(reach / 2) ** 2 * 1.15
    return focal, int(np.ceil(2 * focal * np.tan(reach / 2)))


def _rays(places, focal, half):
    x, y = np.moveaxis((places - half) / (2 * focal), -1, 0)
    square = x * x + y * y
    return np.stack([2 * x, 2 * y, 1 - square], axis=-1) / (1 + square)[..., None]


def _even(picture, valid):
    """Even out exposure: local contrast, spread over 8 bits."""
    weight = valid.astype(np.float32)
    picture = picture * weight
    seen = cv2.blur(weight, (31, 31)) + 1e-6
    detail = (picture - cv2.blur(picture, (31, 31)) / seen) * weight
    power = cv2.blur(detail * detail, (63, 63)) / (cv2.blur(weight, (63, 63)) + 1e-6)
    contrast = np.sqrt(np.maximum(power, 0))
    return np.clip(128 + 48 * detail / (contrast + _NOISE), 0, 255).astype(np.uint8)
