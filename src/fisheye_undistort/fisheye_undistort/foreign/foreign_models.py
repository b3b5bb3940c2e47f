"""Lens models of other programs: functions from rays (..., 3) to pixels (..., 2)."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.ndimage import map_coordinates

Distortion = Callable[[np.ndarray], np.ndarray]


def double_sphere(xi, alpha, fx, fy, cx, cy):
    """Usenko, Demmel and Cremers 2018, doi 10.1109/3DV.2018.00069."""

    def project(rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        first = np.linalg.norm(rays, axis=-1)
        second = np.sqrt(x * x + y * y + (xi * first + z) ** 2)
        depth = alpha * second + (1 - alpha) * (xi * first + z)
        return _scaled(x / depth, y / depth, depth > 0, fx, fy, cx, cy)

    return project


def extended_unified(alpha, beta, fx, fy, cx, cy):
    """Khomutenko, Garcia and Martinet 2016, doi 10.1109/LRA.2015.2502921."""

    def project(rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        depth = alpha * np.sqrt(beta * (x * x + y * y) + z * z) + (1 - alpha) * z
        return _scaled(x / depth, y / depth, depth > 0, fx, fy, cx, cy)

    return project


def unified(xi, fx, fy, cx, cy, distort: Distortion):
    """Mei and Rives 2007, doi 10.1109/ROBOT.2007.364084: `omni` of Kalibr."""

    def project(rays):
        x, y, z = np.moveaxis(rays / np.linalg.norm(rays, axis=-1, keepdims=True), -1, 0)
        u, v = np.moveaxis(distort(np.stack([x / (z + xi), y / (z + xi)], axis=-1)), -1, 0)
        return _scaled(u, v, z > -(1 / xi if xi > 1 else xi), fx, fy, cx, cy)

    return project


def pinhole(fx, fy, cx, cy, distort: Distortion):
    """Project onto a plane, then distort there."""

    def project(rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        u, v = np.moveaxis(distort(np.stack([x / z, y / z], axis=-1)), -1, 0)
        return _scaled(u, v, z > 0, fx, fy, cx, cy)

    return project


def fisheye(fx, fy, cx, cy, coefficients):
    """Kannala and Brandt 2006, doi 10.1109/TPAMI.2006.153, with any number of coefficients."""

    def project(rays):
        x, y, z = np.moveaxis(rays, -1, 0)
        side = np.maximum(np.hypot(x, y), 1e-12)
        angle = np.arctan2(side, z)
        radius = angle * (1 + sum(k * angle ** (2 * i + 2) for i, k in enumerate(coefficients)))
        return _scaled(x * radius / side, y * radius / side, True, fx, fy, cx, cy)

    return project


def stereographic(fx, fy, cx, cy):
    """Return mrcal's stereographic model, whose focal lengths are those at the axis."""

    def project(rays):
        u, v = np.moveaxis(_stereographic(rays), -1, 0)
        return _scaled(u, v, True, fx, fy, cx, cy)

    return project


def splined_stereographic(fx, fy, cx, cy, shifts: np.ndarray, order: int, fov_x_rad: float):
    """Kogan, mrcal: the stereographic model, shifted by a B-spline over its plane.

    Parameters
    ----------
    fx, fy, cx, cy
        px.
    shifts
        (rows, columns, 2) control points.
    order
        Of the spline, 2 or 3.
    fov_x_rad
        Field of view across the control points but for the last.
    """
    rows, columns = shifts.shape[:2]
    per_unit = (columns - order) / (4 * np.tan(fov_x_rad / 4))

    def project(rays):
        plane = _stereographic(rays)
        u, v = np.moveaxis(np.atleast_2d(plane), -1, 0)
        at = np.stack([v * per_unit + (rows - 1) / 2, u * per_unit + (columns - 1) / 2])
        du, dv = (
            map_coordinates(shifts[..., i], at, order=order, prefilter=False, mode='nearest')
            for i in (0, 1)
        )
        known = np.all(
            (at >= 0.5) & (at <= np.array([rows, columns]).reshape(2, *[1] * u.ndim) - 1.5), axis=0
        )
        return _scaled(u + du, v + dv, known, fx, fy, cx, cy)

    return project


def radial_tangential(coefficients: Sequence[float]) -> Distortion:
    """Return the distortion of OpenCV: k1, k2, p1, p2, k3, ... k6, s1 ... s4 as far as given."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = (*coefficients, *[0.0] * 12)[:12]

    def distort(plane):
        x, y = np.moveaxis(plane, -1, 0)
        r = x * x + y * y
        scale = (1 + r * (k1 + r * (k2 + r * k3))) / (1 + r * (k4 + r * (k5 + r * k6)))
        u = x * scale + 2 * p1 * x * y + p2 * (r + 2 * x * x) + s1 * r + s2 * r * r
        v = y * scale + p1 * (r + 2 * y * y) + 2 * p2 * x * y + s3 * r + s4 * r * r
        return np.stack([u, v], axis=-1)

    return distort


def _stereographic(rays: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(rays, -1, 0)
    depth = (np.linalg.norm(rays, axis=-1) + z) / 2
    return np.stack([x / depth, y / depth], axis=-1)


def _scaled(u, v, seen, fx, fy, cx, cy):
    pixels = np.stack([fx * u + cx, fy * v + cy], axis=-1)
    return np.where(np.asarray(seen)[..., None], pixels, np.nan)
