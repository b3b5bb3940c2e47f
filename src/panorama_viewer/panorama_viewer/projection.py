"""A projection in JSON: the fields of fisheye_msgs/Projection under their own names."""

from typing import Any

from fisheye_geometry.surface import Surface


def described(surface: Surface, wraps: bool = False) -> dict[str, Any]:
    """Return what JSON holds of a panorama's surface, and whether its edges meet."""
    return {
        'surface': surface.kind,
        'width': surface.width,
        'height': surface.height,
        'focal_px': surface.focal_px,
        'center_x_px': surface.center_x_px,
        'center_y_px': surface.center_y_px,
        'wraps': wraps,
    }
