"""Building a compositor: from the views of a rig to what draws its panoramas, step by step."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.gain import GainCompensation
from panorama_stitch.compose.layout import lay_out
from panorama_stitch.compose.placing import place
from panorama_stitch.compose.seam import optimise_seams
from panorama_stitch.compose.view import View


@dataclass(frozen=True)
class Style:
    """How a panorama is to look.

    Attributes
    ----------
    blend
        One of `BLENDS`.
    fade_rad
        Width of a feather.
    crop
        One of `CROPS`.
    is_gain_compensated
        Whether the cameras are made equally bright.
    """

    blend: str = 'feather'
    fade_rad: float = np.radians(2.0)
    crop: str = 'valid'
    is_gain_compensated: bool = True


def build_compositor(
    views: Sequence[View], group: Sequence[np.ndarray], style: Style, *, wraps: bool = False
) -> Compositor:
    """Build what composes the panoramas of a rig.

    Parameters
    ----------
    views
        From left to right, each with its attitude in the panorama's frame.
    group
        A picture of each camera, (height, width[, channels]) uint8: they show where the seams fit
        best and how bright the cameras are.
    style
        How to compose.
    wraps
        Whether the panorama leads all around.

    Raises
    ------
    GeometryError
        If there is no surface that holds the panorama.
    """
    placed = place(views, wraps=wraps)
    fade_px = style.fade_rad * placed.surface.focal_px * BLENDS[style.blend].fade_scale
    layout = lay_out(placed, fade_px=fade_px, crop=style.crop)
    layout = optimise_seams(layout, placed, group)
    gain = None
    if style.is_gain_compensated and layout.seams:
        gain = GainCompensation(layout, placed, group)
    return Compositor(layout, placed, style.blend, gain)
