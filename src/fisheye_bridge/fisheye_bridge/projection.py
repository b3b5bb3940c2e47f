"""fisheye_msgs/Projection to surface and back."""

from fisheye_msgs.msg import Projection
from std_msgs.msg import Header

from fisheye_geometry.surface import Surface


def surface_of(message: Projection) -> Surface:
    """Return the surface that a message describes; a `GeometryError` if there is none such."""
    return Surface(
        kind=message.surface,
        width=message.width,
        height=message.height,
        focal_px=message.focal_px,
        center_x_px=message.center_x_px,
        center_y_px=message.center_y_px,
    )


def projection_of(surface: Surface, header: Header, *, wraps: bool = False) -> Projection:
    """Describe a surface in a message."""
    return Projection(
        header=header,
        surface=surface.kind,
        width=surface.width,
        height=surface.height,
        focal_px=surface.focal_px,
        center_x_px=surface.center_x_px,
        center_y_px=surface.center_y_px,
        wraps=wraps,
    )
