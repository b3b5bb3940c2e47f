"""Fit our lens to one of another model."""

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from scipy.optimize import least_squares

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import INTRINSICS, lens_of, pixels_of
from fisheye_undistort.foreign.foreign_files import read_foreign
from fisheye_undistort.foreign.lens_samples import Samples

_GOOD_DEG = 0.1
"""A conversion that is off by more is told to be poor, and a camera that turns by more to turn."""
_TURN = slice(len(INTRINSICS), None)
"""Rotation vector among the unknowns, rad: the z of a spline need not be the axis of the lens."""


@dataclass(frozen=True)
class Conversion:
    """A lens of Kannala and Brandt in place of another one.

    Attributes
    ----------
    lens
        What was fitted.
    model
        What it was fitted to.
    rms_px, worst_px, worst_deg
        How far the lens is from that where the picture shows anything.
    reach_deg
        Largest angle from the axis there.
    turn_deg
        Angle by which its camera is turned against that of the other one.
    """

    lens: FisheyeLens
    model: str
    rms_px: float
    worst_px: float
    worst_deg: float
    reach_deg: float
    turn_deg: float

    @property
    def good(self) -> bool:
        """Whether the lens may stand for the other one."""
        return self.worst_deg <= _GOOD_DEG

    def __str__(self):
        turned = f'; the camera is turned by {self.turn_deg:.1f} degrees'
        if self.turn_deg <= _GOOD_DEG:
            turned = ''
        return (
            f'converted from {self.model}: off by {self.rms_px:.3f} px rms, '
            f'{self.worst_px:.2f} px and {self.worst_deg:.3f} degrees at most, '
            f'out to {self.reach_deg:.0f} degrees{turned}'
        )


def convert(path: str | Path, camera: str = '') -> Conversion:
    """Read a calibration of another program and fit our lens to it.

    Parameters
    ----------
    path, camera
        As `read_foreign`.

    Raises
    ------
    FileAccessError, CameraFileError
        As `read_foreign`.
    """
    samples, model = read_foreign(path, camera)
    unknowns = _fit(samples)
    lens, turned = lens_of(unknowns, samples.size), _turned(samples.rays, unknowns)
    off_px = np.linalg.norm(pixels_of(unknowns, turned) - samples.pixels, axis=-1)
    rays, seen = lens.unproject(samples.pixels)
    apart = np.linalg.norm(np.where(seen[:, None], rays, -turned) - turned, axis=-1)
    return Conversion(
        lens,
        model,
        float(np.sqrt(np.mean(off_px**2))),
        float(off_px.max()),
        float(np.degrees(2 * np.arcsin((apart / 2).clip(0, 1)).max())),
        float(np.degrees(np.arccos(turned[:, 2].clip(-1, 1)).max())),
        float(np.degrees(np.linalg.norm(unknowns[_TURN]))),
    )


def _fit(samples: Samples) -> np.ndarray:
    """Return the intrinsics nearest to samples, and how the camera is turned for them, (11,)."""
    angle = np.arccos(samples.rays[:, 2].clip(-1, 1))
    center = samples.pixels[np.argmin(angle)]
    radius = np.linalg.norm(samples.pixels - center, axis=-1)
    focal = float(np.sum(radius * angle) / np.sum(angle**2))
    start = np.array([focal, focal, *center, *[0.0] * 7])

    def residuals(unknowns):
        turned = _turned(samples.rays, unknowns)
        return (pixels_of(unknowns, turned) - samples.pixels).ravel()

    return least_squares(residuals, start, method='lm', x_scale='jac').x


def _turned(rays: np.ndarray, unknowns: np.ndarray) -> np.ndarray:
    return rays @ cv2.Rodrigues(unknowns[_TURN])[0].T
