"""fisheye_msgs/Projection to surface and back."""

from fisheye_msgs.msg import Projection
from geometry_msgs.msg import Quaternion
from std_msgs.msg import Header

from fisheye_geometry.attitude import LEVEL, Attitude, quaternion
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


def projection_of(
    surface: Surface, header: Header, *, wraps: bool = False, orientation: Attitude = LEVEL
) -> Projection:
    """Describe a surface in a message; `orientation` is its attitude in the level frame."""
    x, y, z, w = quaternion(orientation)
    return Projection(
        header=header,
        surface=surface.kind,
        width=surface.width,
        height=surface.height,
        focal_px=surface.focal_px,
        center_x_px=surface.center_x_px,
        center_y_px=surface.center_y_px,
        wraps=wraps,
        orientation=Quaternion(x=x, y=y, z=z, w=w),
    )
