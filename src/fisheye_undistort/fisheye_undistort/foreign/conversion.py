"""Fit our lens to one of another model."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

from fisheye_geometry.lens import FisheyeLens
from fisheye_undistort.fit.sheet_model import INTRINSICS, lens_of, project
from fisheye_undistort.foreign.foreign_files import read_foreign
from fisheye_undistort.foreign.lens_samples import Samples

_GOOD_DEG = 0.1
"""A conversion that is off by more is told to be poor."""


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
    """

    lens: FisheyeLens
    model: str
    rms_px: float
    worst_px: float
    worst_deg: float
    reach_deg: float

    @property
    def good(self) -> bool:
        """Whether the lens may stand for the other one."""
        return self.worst_deg <= _GOOD_DEG

    def __str__(self):
        return (
            f'converted from {self.model}: off by {self.rms_px:.3f} px rms, '
            f'{self.worst_px:.2f} px and {self.worst_deg:.3f} degrees at most, '
            f'out to {self.reach_deg:.0f} degrees'
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
    lens = lens_of(unknowns, samples.size)
    off_px = np.linalg.norm(project(unknowns, samples.rays)[0] - samples.pixels, axis=-1)
    rays, seen = lens.unproject(samples.pixels)
    apart = np.linalg.norm(np.where(seen[:, None], rays, -samples.rays) - samples.rays, axis=-1)
    return Conversion(
        lens,
        model,
        float(np.sqrt(np.mean(off_px**2))),
        float(off_px.max()),
        float(np.degrees(2 * np.arcsin((apart / 2).clip(0, 1)).max())),
        float(np.degrees(np.arccos(samples.rays[:, 2].clip(-1, 1)).max())),
    )


def _fit(samples: Samples) -> np.ndarray:
    """Return the intrinsics (8,) nearest to samples."""
    angle = np.arccos(samples.rays[:, 2].clip(-1, 1))
    center = samples.pixels[np.argmin(angle)]
    radius = np.linalg.norm(samples.pixels - center, axis=-1)
    focal = float(np.sum(radius * angle) / np.sum(angle**2))
    start = np.array([focal, focal, *center, 0, 0, 0, 0], float)

    def residuals(unknowns):
        return (project(unknowns, samples.rays)[0] - samples.pixels).ravel()

    def jacobian(unknowns):
        return project(unknowns, samples.rays)[1].reshape(-1, len(INTRINSICS))

    return least_squares(residuals, start, jacobian, method='lm', x_scale='jac').x
