"""Settings of overlap calibration: which method, what is known before, and the paper's steps."""

from dataclasses import dataclass
from math import nan

from fisheye_core.settings import setting

METHODS = ('particles', 'correlation', 'paper')
"""Names of the methods; `overlap.methods` has them as functions."""


@dataclass(frozen=True)
class OverlapSettings:
    """How the overlap of two neighbouring cameras is measured."""

    method: str = setting(
        'particles',
        'How the overlap is found: particles measures the rotation on many local votes, '
        'correlation searches all offsets, paper is the published rule as it is.',
        choices=METHODS,
        live=True,
    )
    min_confidence: float = setting(
        0.7,
        'Confidence below which two views count as having no common scene; by particles a '
        'probability.',
        minimum=0.0,
        maximum=1.0,
        live=True,
    )
    expected_yaw_deg: float = setting(
        nan,
        'Angle between neighbouring optical axes, deg; decides where the scene repeats itself; '
        'NaN: not known.',
        minimum=0.0,
        maximum=360.0,
        nan=True,
        live=True,
    )
    yaw_tolerance_deg: float = setting(
        5.0,
        'How far the overlap may lie from expected_yaw_deg, deg.',
        minimum=0.1,
        maximum=180.0,
        live=True,
    )
    min_overlap_deg: float = setting(
        5.0,
        'Narrower overlaps are not looked for by correlation, deg.',
        minimum=2.0,
        maximum=90.0,
        live=True,
    )
    max_rise_deg: float = setting(
        4.0,
        'How far the right view may lie above or below the left one, by correlation, deg.',
        minimum=0.0,
        maximum=20.0,
        live=True,
    )
    correct_tilt: bool = setting(
        True,
        'Correct the pitch and roll of the right camera against the left one, as measured.',
        live=True,
    )
    paper_classes: int = setting(
        2,
        "Classes into which the paper's threshold sorts grey levels.",
        minimum=2,
        maximum=8,
        live=True,
    )
    paper_opening_px: int = setting(
        3,
        "Side of the square that opens the paper's particles, px.",
        minimum=1,
        maximum=31,
        live=True,
    )
    paper_erosions: int = setting(
        9,
        "Erosions that the paper's particles must survive.",
        minimum=0,
        maximum=100,
        live=True,
    )
