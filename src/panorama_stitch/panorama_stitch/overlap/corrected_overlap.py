"""The overlap of two corrected images: by the full search over offsets, or by the published rule.

The full search proposes offsets; each is verified by correlating the structure of the overlap tile
by tile, and the winner is refined to a fraction of a pixel.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import inf, isnan, nan, radians

import numpy as np

from fisheye_geometry.attitude import LEVEL
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap import paper, wording
from panorama_stitch.overlap.corrected_pairs import check_pairs
from panorama_stitch.overlap.overlap_result import (
    Overlap,
    attitude_at,
    common_px,
    side_by_side,
)
from panorama_stitch.overlap.overlap_settings import OverlapSettings
from panorama_stitch.overlap.registration import Registration, fit_at, register
from panorama_stitch.overlap.view import seen_grey_of


def measure_corrected(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]],
    surface_left: Surface,
    surface_right: Surface,
    settings: OverlapSettings,
    method: str,
) -> Overlap:
    """Measure the overlap of two neighbouring cameras on their corrected images.

    Parameters
    ----------
    pairs
        One or more (left, right) corrected pictures (height, width[, channels]) uint8, 0 exactly
        where the lens sees nothing. Of several the median decides, so that somebody who walks
        through does not.
    surface_left, surface_right
        What they are on; of one kind and one focal length.
    settings
        How to measure.
    method
        'correlation' or 'paper'.

    Raises
    ------
    OverlapError
        If a picture is missing or fits its surface not, or the surfaces do not fit together.
    """
    check_pairs(pairs, surface_left, surface_right)
    overlaps = [
        _Measurement(left, right, surface_left, surface_right, settings).run(method)
        for left, right in pairs
    ]
    found = sorted((o for o in overlaps if o.found), key=lambda o: o.offset_x_px)
    if 2 * len(found) <= len(overlaps):
        return max((o for o in overlaps if not o.found), key=lambda o: o.confidence)
    return found[len(found) // 2]


class _Measurement:
    """One pair of pictures, measured."""

    def __init__(self, left, right, surface_left, surface_right, settings):
        self._left, self._right = seen_grey_of(left), seen_grey_of(right)
        self._surfaces = surface_left, surface_right
        self._settings = settings
        self._half_start = surface_left.width - surface_left.width // 2

    def run(self, method: str) -> Overlap:
        if method == 'paper':
            return self._by_paper()
        if np.array_equal(self._left, self._right):
            message = 'both views are the same picture; is one camera used twice, or both covered?'
            return side_by_side(self._surfaces[0], 'correlation', message)
        found = register(
            self._left, self._right, *self._surfaces, self._settings, self._expected()
        )
        if found.confidence < self._settings.min_confidence:
            return self._not_found(found)
        return self._found(found)

    def _by_paper(self) -> Overlap:
        s = self._settings
        left, right, match = paper.find_match(
            self._left,
            self._right,
            classes=s.paper_classes,
            opening=s.paper_opening_px,
            erosions=s.paper_erosions,
        )
        if match is None:
            message = 'no similar particles: the views stay whole, side by side'
            aside = side_by_side(self._surfaces[0], 'paper', message)
            return replace(aside, left_particles=left, right_particles=right)
        width = self._surfaces[0].width
        x = paper.offset_x(width, left[match.left], right[match.right])
        return Overlap(
            method='paper',
            found=True,
            offset_x_px=x,
            offset_y_px=0.0,
            attitude=attitude_at(x, 0.0, *self._surfaces, LEVEL),
            overlap_px=common_px(x, *self._surfaces),
            confidence=fit_at(self._left, self._right, *self._surfaces, x),
            min_correlation_value=match.min_correlation_value,
            left_particles=left,
            right_particles=right,
            left_match=match.left,
            right_match=match.right,
            message=f'the most similar particles put the right view at {x:.0f} px',
        )

    def _expected(self) -> tuple[float, float]:
        """Offsets of the facing halves, px, that the rig's geometry allows."""
        s = self._settings
        if isnan(s.expected_yaw_deg) or not self._surfaces[0].yaw_is_column_shift:
            return -inf, inf
        left, right = self._surfaces
        first = left.center_x_px - right.center_x_px - self._half_start
        return tuple(
            first + left.focal_px * radians(s.expected_yaw_deg + by)
            for by in (-s.yaw_tolerance_deg, s.yaw_tolerance_deg)
        )

    def _found(self, found: Registration) -> Overlap:
        x, y = found.pose.x_px + self._half_start, found.pose.y_px
        overlap = Overlap(
            method='correlation',
            found=True,
            offset_x_px=x,
            offset_y_px=y,
            attitude=attitude_at(x, y, *self._surfaces, found.pose.turn),
            overlap_px=common_px(x, *self._surfaces),
            confidence=found.confidence,
        )
        rival_x_px = found.rival_x_px + self._half_start if found.distinct < 1 else nan
        return replace(overlap, message=wording.description(overlap, *self._surfaces, rival_x_px))

    def _not_found(self, found) -> Overlap:
        needed = self._settings.min_confidence
        message = f'no common scene: confidence {found.confidence:.2f}, {needed:.2f} is needed'
        if found.rival_fit >= needed:
            offsets = found.pose.x_px + self._half_start, found.rival_x_px + self._half_start
            message = wording.repetition(*offsets, *self._surfaces)
        aside = side_by_side(self._surfaces[0], 'correlation', message)
        return replace(aside, confidence=found.confidence)
