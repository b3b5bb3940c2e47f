"""The overlap of two neighbouring cameras, measured once on what they see.

Particles, or the full search, propose offsets; each is verified by correlating the structure of
the overlap tile by tile, and the winner is refined to a fraction of a pixel.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import degrees, nan, radians

import cv2
import numpy as np

from fisheye_geometry.errors import OverlapError
from fisheye_geometry.remap import LEVEL, Turn
from fisheye_geometry.settings import setting
from fisheye_geometry.surface import Surface
from panorama_stitch import paper
from panorama_stitch.alignment import align, certainty
from panorama_stitch.correlation import Landscape, correlate
from panorama_stitch.particles import Particle, facing_halves
from panorama_stitch.pose import Pose
from panorama_stitch.structure import plain, structure

METHODS = ('particles', 'correlation', 'paper')

_SEARCH_PX_PER_DEG, _FINE_PX_PER_DEG = 2.0, 4.0
_SEARCH_DEG, _FINE_DEG = 3.2, 0.8
_CANDIDATES = 8
_CLOSE = 0.1
_APART_DEG = 3.0
"""Offsets nearer to each other are the same answer."""
_FOCAL_TOLERANCE = 1e-3
"""Relative difference of the focal lengths that moves a whole picture by less than a pixel."""


@dataclass(frozen=True)
class OverlapSettings:
    """How the overlap of two neighbouring cameras is measured."""

    method: str = setting(
        'particles',
        'how the overlap is found: particles that propose and correlation that verifies, '
        'correlation over all offsets, or the published rule as it is',
        choices=METHODS, live=True,
    )
    min_confidence: float = setting(
        0.35, 'confidence below which two views count as having no common scene',
        minimum=0.0, maximum=1.0, live=True,
    )
    expected_yaw_deg: float = setting(
        nan, 'angle between neighbouring optical axes, deg; decides where the scene repeats '
        'itself; NaN: not known', minimum=0.0, maximum=360.0, nan=True, live=True,
    )
    yaw_tolerance_deg: float = setting(
        5.0, 'how far the overlap may lie from expected_yaw_deg, deg',
        minimum=0.1, maximum=180.0, live=True,
    )
    min_overlap_deg: float = setting(
        5.0, 'narrower overlaps are not looked for, deg', minimum=2.0, maximum=90.0, live=True,
    )
    max_rise_deg: float = setting(
        4.0, 'how far the right picture may lie above or below the left one, deg',
        minimum=0.0, maximum=20.0, live=True,
    )
    correct_tilt: bool = setting(
        True, 'whether the small pitch and roll of the right camera are measured and corrected',
        live=True,
    )
    paper_classes: int = setting(
        2, "classes that the paper's threshold sorts grey levels into", minimum=2, maximum=8,
        live=True,
    )
    paper_opening_px: int = setting(
        3, "side of the square that opens the paper's particles, px", minimum=1, maximum=31,
        live=True,
    )
    paper_erosions: int = setting(
        9, "erosions that the paper's particles must survive", minimum=0, maximum=100, live=True,
    )


@dataclass(frozen=True)
class Overlap:
    """Where the right picture lies in the left one, and how sure that is.

    Attributes
    ----------
    method
        What decided, one of `METHODS`.
    found
        False: no common scene; the offset puts the pictures side by side.
    offset_x_px, offset_y_px
        Where the right picture's upper left corner lies in the left picture, after the right
        camera was turned by `turn`.
    turn
        The right camera's small turn that closes the seam; level where not measured.
    overlap_px
        Columns that both pictures fill.
    confidence
        0 to 1: zero-mean normalised cross-correlation of the structure of the overlap, lowered
        where a second offset is nearly as good.
    min_correlation_value
        The paper's measure for the matched particles; NaN where none matched.
    left_particles, right_particles
        What was found in the facing halves.
    left_match, right_match
        Indices of the matched pair, -1 where none matched.
    message
        One sentence for a person.
    """

    method: str
    found: bool
    offset_x_px: float
    offset_y_px: float
    turn: Turn = LEVEL
    overlap_px: float = 0.0
    confidence: float = 0.0
    min_correlation_value: float = nan
    left_particles: tuple[Particle, ...] = ()
    right_particles: tuple[Particle, ...] = ()
    left_match: int = -1
    right_match: int = -1
    message: str = ''


def measure_overlap(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]],
    surface_left: Surface,
    surface_right: Surface,
    settings: OverlapSettings,
    method: str | None = None,
) -> Overlap:
    """Measure the overlap of two neighbouring cameras.

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
        One of `METHODS`; None: as the settings say.

    Raises
    ------
    OverlapError
        If a picture is missing or fits its surface not, or the surfaces do not fit together.
    """
    method = method or settings.method
    _check(pairs, surface_left, surface_right, method)
    overlaps = [
        _Measurement(left, right, surface_left, surface_right, settings).run(method)
        for left, right in pairs
    ]
    found = sorted((o for o in overlaps if o.found), key=lambda o: o.offset_x_px)
    if 2 * len(found) <= len(overlaps):
        return max((o for o in overlaps if not o.found), key=lambda o: o.confidence)
    return found[len(found) // 2]


def _check(pairs, surface_left, surface_right, method) -> None:
    if method not in METHODS:
        raise OverlapError(f"method '{method}' is not known; expected one of {', '.join(METHODS)}")
    if not pairs:
        raise OverlapError('no pair of pictures was given; expected at least one')
    if surface_left.kind != surface_right.kind:
        raise OverlapError(
            f'the left picture is {surface_left.kind}, the right one {surface_right.kind}; '
            'expected one kind of surface'
        )
    if abs(surface_left.focal_px / surface_right.focal_px - 1) > _FOCAL_TOLERANCE:
        raise OverlapError(
            f'the pictures have focal lengths of {surface_left.focal_px:g} and '
            f'{surface_right.focal_px:g} px; expected one for both'
        )
    for pair in pairs:
        for side, picture, surface in zip(
            ('left', 'right'), pair, (surface_left, surface_right), strict=True
        ):
            if picture is None:
                raise OverlapError(f'the {side} picture is missing')
            if picture.dtype != np.uint8 or picture.shape[:2] != (surface.height, surface.width):
                raise OverlapError(
                    f'the {side} picture is {picture.dtype}{picture.shape}; expected uint8 of '
                    f'{surface.width}x{surface.height} px'
                )


class _Measurement:
    """One pair of pictures, measured."""

    def __init__(self, left, right, surface_left, surface_right, settings):
        self._surfaces = surface_left, surface_right
        self._settings = settings
        self._pictures = _grey(left), _grey(right)
        self._left, self._right = facing_halves(*self._pictures)
        self._left_start = surface_left.width - self._left.shape[1]
        self._px_per_deg = surface_left.focal_px * radians(1)
        self._level_y = surface_left.center_y_px - surface_right.center_y_px

    def run(self, method: str) -> Overlap:
        if method == 'paper':
            return self._by_paper()
        return self._by_structure(method)

    def _by_paper(self) -> Overlap:
        s = self._settings
        left, right, match = paper.measure_by_paper(
            *self._pictures, classes=s.paper_classes, opening=s.paper_opening_px,
            erosions=s.paper_erosions,
        )
        if match is None:
            return replace(
                self._side_by_side('paper', 0.0, 'no similar particles: the views stay side by side'),
                left_particles=left, right_particles=right,
            )
        x = paper.paper_offset(self._surfaces[0].width, left[match.left], right[match.right])
        return Overlap(
            method='paper', found=True, offset_x_px=x, offset_y_px=0.0,
            overlap_px=max(0.0, self._surfaces[0].width - x),
            min_correlation_value=match.min_correlation_value,
            left_particles=left, right_particles=right,
            left_match=match.left, right_match=match.right,
            message=f'the most similar particles put the right view at {x:.0f} px',
        )

    def _by_structure(self, method: str) -> Overlap:
        step = self._step(_SEARCH_PX_PER_DEG)
        left, right = structure(self._left, step), structure(self._right, step)
        landscape = self._search(left, right, step)
        peaks = landscape.peaks(_CANDIDATES, round(_APART_DEG * self._px_per_deg / step))
        method = 'correlation'
        if not peaks:
            return self._side_by_side(method, 0.0, 'the views show no common structure')
        surface = self._reduced_surface(right, step)
        level = self._level_y / step
        best, confidence = None, -1.0
        for row, column in peaks:
            if landscape.score[row, column] < landscape.score[peaks[0]] - _CLOSE:
                continue
            start = Pose(float(landscape.x[column]), float(landscape.y[row]))
            pose = align(left, right, surface, start, level, radians(_SEARCH_DEG), self._settings.correct_tilt)
            for one in (start, pose):
                sure = certainty(left, right, surface, one)
                if sure > confidence:
                    best, confidence = one, sure
        if confidence < self._settings.min_confidence:
            return self._side_by_side(method, confidence, 'no common scene')
        fine = self._step(_FINE_PX_PER_DEG)
        views = plain(self._left, fine), plain(self._right, fine)
        pose = align(
            *views, self._reduced_surface(views[1], fine), best.scaled(step / fine), self._level_y / fine,
            radians(_FINE_DEG), self._settings.correct_tilt,
        ).scaled(fine)
        x = pose.x_px + self._left_start
        return Overlap(
            method=method, found=True, offset_x_px=x, offset_y_px=pose.y_px,
            turn=pose.turn, overlap_px=self._surfaces[0].width - x,
            confidence=confidence,
            message=f'found {x:.1f} px; pitch {degrees(pose.pitch_rad):.2f}',
        )

    def _step(self, px_per_deg: float) -> int:
        return max(1, round(self._px_per_deg / px_per_deg))

    def _search(self, left, right, step) -> Landscape:
        rise = round(self._settings.max_rise_deg * self._px_per_deg / step)
        level = round(self._level_y / step)
        narrowest = round(self._settings.min_overlap_deg * self._px_per_deg / step)
        y = range(level - rise, level + rise + 1)
        x = range(narrowest - right.image.shape[1], left.image.shape[1] - narrowest + 1)
        return correlate(left, right, x, y, min_pixels=narrowest * left.image.shape[0] // 4)

    def _reduced_surface(self, right, step) -> Surface:
        height, width = right.image.shape
        s = self._surfaces[1]
        return replace(
            s, width=width, height=height, focal_px=s.focal_px / step,
            center_x_px=(s.center_x_px + 0.5) / step - 0.5,
            center_y_px=(s.center_y_px + 0.5) / step - 0.5,
        )

    def _side_by_side(self, method, confidence, message) -> Overlap:
        return Overlap(
            method=method, found=False, offset_x_px=float(self._surfaces[0].width),
            offset_y_px=0.0, confidence=float(np.clip(confidence, 0, 1)), message=message,
        )


def _grey(picture):
    if picture.ndim == 2:
        return picture
    if picture.shape[2] == 1:
        return picture[..., 0]
    # What is seen stays seen: (1, 0, 0) must not turn black.
    return np.maximum(cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY), picture.max(axis=2) > 0)
