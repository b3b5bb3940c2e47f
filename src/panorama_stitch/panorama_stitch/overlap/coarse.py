"""Rotations at which two coarse pictures agree: proposals where features are few.

Dark, noisy or blurred views show hardly a feature, but what is larger than a degree or two. Most
rigs are level, nod, or hang upside down: their pictures around the vertical are shifted against
each other. A nod of both cameras turns the two about the line of sight of the seam, so pictures of
several nods are compared, each at all shifts by Fourier transforms. Only what changes along a row
within some degrees counts: a horizon would fit at every shift.
"""

from collections.abc import Iterator

import cv2
import numpy as np
from scipy import fft
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.strips import seam_rays
from panorama_stitch.overlap.view import OverlapView

_HIGHEST_DEG = 50
"""Pictures have a pixel a degree, all around, and up and down to here."""
_NODS_DEG = range(-20, 21, 5)
_RISE_DEG = 20
"""How far the seam of one camera may lie above that of the other."""
_LEAST_YAW_DEG = 8
_DETAIL_PX, _NEIGHBOURHOOD_PX = 13, 21
_NOISE = 2.0
"""Grey levels that count as contrast nowhere."""
_MOST_CONTRAST = 2.0
_LEAST_ENERGY = 30.0
"""Pixels below which an overlap is none."""
_PEAKS, _PEAK_DEG = 4, (8, 5)
"""Shifts that are kept of each nod, and how far they are apart, up and along."""


def coarse_rotations(left: OverlapView, right: OverlapView, usable) -> list[np.ndarray]:
    """Find rotations (3, 3) of right rays to left ones, the most significant one first.

    Parameters
    ----------
    left, right
        The views.
    usable
        Of either: (height, width) uint8, 255 where it may be used.
    """
    azimuth = np.radians(np.arange(-180, 180))
    elevation = np.radians(np.arange(-_HIGHEST_DEG, _HIGHEST_DEG))
    level = seam_rays(elevation[:, None], azimuth)[..., [1, 0, 2]]
    found = []
    for nod_deg in _NODS_DEG:
        nod = _about('X', nod_deg)
        spectra = (
            _spectra(*_picture(view, seen, level @ nod))
            for view, seen in zip((left, right), usable, strict=True)
        )
        for score, rise_deg, yaw_deg in _peaks(*spectra):
            half = _about('Y', yaw_deg / 2)
            found.append((score, nod.T @ half @ _about('X', -rise_deg) @ half @ nod))
    return [rotation for _, rotation in sorted(found, key=lambda one: -one[0])]


def _about(axis, angle_deg):
    return Rotation.from_euler(axis, angle_deg, degrees=True).as_matrix()


def _picture(view, usable, rays):
    """Detail of what is seen along rays, of even contrast, and where anything is seen."""
    shape = rays.shape[:2]
    image, valid = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    ahead = np.flatnonzero((rays[..., 2] > np.cos(view.reach_rad)).any(axis=0))
    part = np.s_[:, ahead[0] : ahead[-1] + 1]
    image[part], valid[part] = view.sample(rays[part], usable, np.radians(0.5) * view.density)

    def mean(values, size):
        return cv2.blur(values * valid, size) / (cv2.blur(valid, size) + 1e-6)

    detail = image - mean(image, (_DETAIL_PX, 1))
    contrast = np.sqrt(np.maximum(mean(detail**2, (_NEIGHBOURHOOD_PX, _NEIGHBOURHOOD_PX)), 0))
    return np.clip(detail / (contrast + _NOISE), -_MOST_CONTRAST, _MOST_CONTRAST) * valid, valid


def _spectra(detail, valid):
    shape = fft.next_fast_len(len(detail) + _RISE_DEG + 1), detail.shape[1]
    return [fft.rfft2(values, shape) for values in (detail, detail**2, valid)], shape


def _peaks(left, right) -> Iterator[tuple[float, int, int]]:
    """Yield the significance of the best shifts, how far they rise, and how far they turn."""
    ((a, a_square, a_seen), shape), ((b, b_square, b_seen), _) = left, right
    both, a_energy, b_energy = (
        fft.irfft2(one * other.conj(), shape)
        for one, other in ((a, b), (a_square, b_seen), (a_seen, b_square))
    )
    energy = np.sqrt(np.maximum(a_energy, 0) * np.maximum(b_energy, 0))
    score = both * np.sqrt(energy) / np.maximum(energy, _LEAST_ENERGY)
    rise = np.arange(-_RISE_DEG, _RISE_DEG + 1)
    yaw = (np.arange(shape[1]) + 180) % 360 - 180
    score = score[rise]
    score[:, np.abs(yaw) < _LEAST_YAW_DEG] = 0
    for _ in range(_PEAKS):
        row, column = np.unravel_index(score.argmax(), score.shape)
        yield float(score[row, column]), rise[row], yaw[column]
        around = np.abs((yaw - yaw[column] + 180) % 360 - 180) <= _PEAK_DEG[1]
        score[np.ix_(np.abs(rise - rise[row]) <= _PEAK_DEG[0], around)] = 0
