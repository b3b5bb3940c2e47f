"""What was found out about an overlap, in a sentence for a person."""

from math import degrees, isnan, nan

from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.surface import Surface
from panorama_stitch.overlap.overlap_result import Overlap, yaw_between_rad

_SHOWN_DEG = 0.05
"""Less is level for a person."""


def description(overlap: Overlap, left: Surface, right: Surface, rival_x_px: float = nan) -> str:
    """Describe an overlap that was found.

    Parameters
    ----------
    overlap
        It.
    left, right
        What the pictures are on.
    rival_x_px
        A second offset that is nearly as good; NaN if there is none.
    """
    parts = [f'the right view begins at {place(overlap.offset_x_px, left, right)}']
    if tilt := _tilt(overlap.attitude or LEVEL):
        parts.append(f'its camera {tilt}')
    parts.append(f'confidence {overlap.confidence:.2f}')
    if not isnan(rival_x_px):
        parts.append(f'though {place(rival_x_px, left, right)} fits nearly as well')
    return ', '.join(parts)


def repetition(here_px: float, there_px: float, left: Surface, right: Surface) -> str:
    """Return the sentence that two offsets fit alike."""
    here, there = (place(offset_px, left, right) for offset_px in (here_px, there_px))
    return (
        f'the scene repeats itself: {here} and {there} fit alike; set expected_yaw_deg or '
        'show the cameras something unique'
    )


def place(offset_x_px: float, left: Surface, right: Surface) -> str:
    """Return an offset in px and, where there is one, the angle that it means."""
    text = f'{offset_x_px:.1f} px'
    apart = yaw_between_rad(offset_x_px, left, right)
    return text if isnan(apart) else f'{text} ({degrees(apart):.2f} degrees)'


def direction(attitude: Attitude) -> str:
    """Describe where the right camera looks in the frame of the left one."""
    words = f'the right camera looks {degrees(attitude.yaw_rad):.2f} degrees to the right'
    return ', '.join(filter(None, (words, _tilt(attitude))))


def _tilt(attitude: Attitude) -> str:
    """Describe pitch and roll; '' where there is none that a person would see."""
    pitch, roll = degrees(attitude.pitch_rad), degrees(attitude.roll_rad)
    if max(abs(pitch), abs(roll)) < _SHOWN_DEG:
        return ''
    return f'pitched by {pitch:.2f} and rolled by {roll:.2f} degrees'
