"""Pairs of corrected images: what must hold before an overlap is looked for in them."""

from collections.abc import Sequence

import numpy as np

from fisheye_core.errors import OverlapError
from fisheye_geometry.surface import Surface

_SMALLEST_PX = 32
"""Sides of a picture that can hold an overlap."""
_FOCAL_TOLERANCE = 1e-3
"""Relative difference of the focal lengths that moves a whole picture by less than a pixel."""


def check_pairs(
    pairs: Sequence[tuple[np.ndarray, np.ndarray]], surface_left: Surface, surface_right: Surface
) -> None:
    """Raise an `OverlapError` where images and surfaces do not fit, or not together."""
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
    for surface in (surface_left, surface_right):
        if min(surface.width, surface.height) < _SMALLEST_PX:
            raise OverlapError(
                f'a picture of {surface.width}x{surface.height} px is too small; expected at '
                f'least {_SMALLEST_PX} px to each side'
            )
    for left, right in pairs:
        _check_picture('left', left, surface_left)
        _check_picture('right', right, surface_right)


def _check_picture(side, picture, surface) -> None:
    if picture is None:
        raise OverlapError(f'the {side} picture is missing')
    if picture.dtype != np.uint8 or picture.shape[:2] != (surface.height, surface.width):
        raise OverlapError(
            f'the {side} picture is {picture.dtype}{picture.shape}; expected uint8 of '
            f'{surface.width}x{surface.height} px'
        )
