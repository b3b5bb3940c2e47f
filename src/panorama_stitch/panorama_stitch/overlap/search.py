"""Where an overlap is looked for."""

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True)
class Search:
    """What is known before anything is seen.

    Attributes
    ----------
    x_px
        Smallest and largest offset of the right half in the left one.
    max_rise_deg
        How far the right view may lie above or below the left one.
    min_overlap_deg
        Narrowest overlap to look for.
    tilt
        Whether the right camera may be turned.
    min_confidence
        Confidence at which an offset is taken for found.
    """

    x_px: tuple[float, float] = (-inf, inf)
    max_rise_deg: float = 4.0
    min_overlap_deg: float = 5.0
    tilt: bool = True
    min_confidence: float = 0.3
