"""The particles of two facing halves, and the pair of them that the measured rotation matches."""

from dataclasses import astuple, replace
from math import radians

import numpy as np

from fisheye_geometry.surface import Surface
from panorama_stitch.overlap import paper
from panorama_stitch.overlap.overlap_result import Overlap
from panorama_stitch.overlap.overlap_settings import OverlapSettings

_SAME_RAD = radians(2.0)
"""Centres of mass of one thing seen from two places lie nearer to each other."""


def with_particles(
    overlap: Overlap,
    images: tuple[np.ndarray, np.ndarray],
    surfaces: tuple[Surface, Surface],
    settings: OverlapSettings,
) -> Overlap:
    """Return an overlap with the particles of both corrected images, as published.

    Parameters
    ----------
    overlap
        What was measured.
    images, surfaces
        Corrected grey images (height, width) uint8, left and right, and what they are on.
    settings
        How particles are found.

    Returns
    -------
    Overlap
        Matched are the two particles that are most alike of those that the rotation brings
        together; none where no overlap was found.
    """
    left, right, _ = paper.find_match(
        *images,
        classes=settings.paper_classes,
        opening=settings.paper_opening_px,
        erosions=settings.paper_erosions,
    )
    overlap = replace(overlap, left_particles=left, right_particles=right)
    if overlap.attitude is None or not (left and right):
        return overlap
    half_start = images[0].shape[1] - images[0].shape[1] // 2
    (left_x, left_y), (right_x, right_y) = (
        np.array([astuple(particle)[:2] for particle in particles]).T
        for particles in (left, right)
    )
    left_rays = surfaces[0].rays(left_x + half_start, left_y)
    right_rays = surfaces[1].rays(right_x, right_y) @ overlap.attitude.matrix.T
    left_rays, right_rays = (
        rays / np.linalg.norm(rays, axis=-1, keepdims=True) for rays in (left_rays, right_rays)
    )
    apart_rad = np.arccos(np.clip(left_rays @ right_rays.T, -1.0, 1.0))
    differences = np.where(apart_rad < _SAME_RAD, paper.mean_differences(left, right), np.inf)
    n, m = np.unravel_index(np.argmin(differences), differences.shape)
    if not np.isfinite(differences[n, m]):
        return overlap
    return replace(
        overlap,
        left_match=int(n),
        right_match=int(m),
        min_correlation_value=float(differences[n, m]),
    )
