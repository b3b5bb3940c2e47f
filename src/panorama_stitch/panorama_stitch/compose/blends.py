"""The ways to blend, by name."""

from typing import NamedTuple

from panorama_stitch.compose.blend import BlendKind, Feather, Multiband
from panorama_stitch.compose.flow import Flow


class NamedBlend(NamedTuple):
    """A way to blend.

    Attributes
    ----------
    kind
        What blends a seam.
    fade_scale
        Width of the fade in units of `feather_deg`.
    """

    kind: BlendKind
    fade_scale: float


BLENDS = {
    'none': NamedBlend(Feather, 0.0),
    'feather': NamedBlend(Feather, 1.0),
    'multiband': NamedBlend(Multiband, 4.0),
    'flow': NamedBlend(Flow, 1.0),
}
