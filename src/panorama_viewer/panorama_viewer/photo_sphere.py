"""A panorama as the part of a photo sphere that it covers.

An equirectangular JPEG with the GPano tags by which viewers of photo spheres know its place.
"""

from dataclasses import replace
from math import atan, atan2, ceil, degrees, floor, hypot, pi

import cv2
import numpy as np

from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import LEVEL, Attitude, attitude_of
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.surface import Surface
from panorama_viewer.projection import Quaternion

_JPEG_QUALITY = 95
_BORDER_POINTS = 400
_REACH_PX = 3
"""What cubic interpolation needs beyond a pixel, and one for rounding."""
_XMP_NAMESPACE = b'http://ns.adobe.com/xap/1.0/\0'
_XMP = """<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>
<x:xmpmeta xmlns:x="adobe:ns:meta/">
  <rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
    <rdf:Description rdf:about="" xmlns:GPano="http://ns.google.com/photos/1.0/panorama/"
{tags}/>
  </rdf:RDF>
</x:xmpmeta>
<?xpacket end="r"?>"""


def gpano(
    image: np.ndarray,
    surface: Surface,
    wraps: bool = False,
    orientation: Quaternion | None = None,
) -> bytes:
    """Return a level equirectangular JPEG of a panorama, with its GPano tags.

    The tags are those of Google's Photo Sphere XMP Metadata. One that `wraps` is all around the
    sphere, without a gap at its edges.

    Raises
    ------
    GeometryError
        If the panorama is wider than 360 degrees.
    """
    turn = attitude_of(*orientation) if orientation else LEVEL
    if wraps:
        image, surface = _repeated(image, surface)
        parts = [surface]
    else:
        parts = _parts(surface)
    sphere, left_px, top_px = on_sphere(parts[0], turn)
    drawn = [RemapTable(part, sphere, 'cubic', turn)(image) for part in parts]
    equirectangular = np.maximum.reduce(drawn)  # black where nothing is seen
    quality = (cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY)
    jpeg = cv2.imencode('.jpg', equirectangular, quality)[1].tobytes()
    full_px = round(2 * pi * sphere.focal_px)
    tags = {
        'ProjectionType': 'equirectangular',
        'UsePanoramaViewer': 'True',
        'FullPanoWidthPixels': full_px,
        'FullPanoHeightPixels': full_px // 2,
        'CroppedAreaImageWidthPixels': sphere.width,
        'CroppedAreaImageHeightPixels': sphere.height,
        'CroppedAreaLeftPixels': left_px,
        'CroppedAreaTopPixels': top_px,
    }
    return with_xmp(jpeg, tags)


def _repeated(image: np.ndarray, surface: Surface) -> tuple[np.ndarray, Surface]:
    """Repeat what is beyond the edges, so that 180 degrees to each side and more are there."""
    beyond_px = ceil(abs(surface.center_x_px - (surface.width - 1) / 2)) + _REACH_PX
    image = cv2.copyMakeBorder(image, 0, 0, beyond_px, beyond_px, cv2.BORDER_WRAP)
    return image, surface.window(-beyond_px, 0, image.shape[1], surface.height)


def _parts(surface: Surface) -> list[Surface]:
    """Return a surface once for each turn, by which its rays have bearings within 180 degrees."""
    around_px = surface.circumference_px
    if surface.width - 1 > around_px:
        raise GeometryError(
            f'the panorama is {degrees(surface.width / surface.focal_px):.0f} degrees wide, as '
            'frames side by side are; expected at most the 360 of a photo sphere'
        )
    if not surface.yaw_is_column_shift:
        return [surface]
    x = surface.center_x_px
    left, right = ((edge - x) / around_px for edge in (-0.5, surface.width - 0.5))
    turns = range(floor(left + 0.5), ceil(right - 0.5) + 1)
    return [replace(surface, center_x_px=x + turn * around_px) for turn in turns]


def on_sphere(surface: Surface, turn: Attitude = LEVEL) -> tuple[Surface, int, int]:
    """Return the equirectangular part of the sphere that a panorama covers.

    Its scale is the panorama's own, rounded so that the sphere is a whole and even number of
    pixels around; bearing 0 is in the middle of the sphere. A panorama that goes beyond 180
    degrees to a side has all its width. One that is turned against the level covers more of it.

    Returns
    -------
    surface : Surface
        The part, without columns or rows at its edges that are not covered to their middle.
    left_px, top_px : int
        Where the part begins on the whole sphere.
    """
    around_px = 2 * round(pi * surface.focal_px)
    focal_px = around_px / (2 * pi)
    left, right, top, bottom = (
        angle * focal_px + around_px / share
        for angle, share in zip(_limits(surface, turn), (2, 2, 4, 4), strict=True)
    )
    if left < 0 or right > around_px:
        left, right = 0, around_px
    left_px, top_px = ceil(left), max(ceil(top), 0)
    part = Surface(
        'equirectangular',
        width=floor(right) - left_px,
        height=min(floor(bottom), around_px // 2) - top_px,
        focal_px=focal_px,
        center_x_px=around_px / 2 - 0.5 - left_px,
        center_y_px=around_px / 4 - 0.5 - top_px,
    )
    return part, left_px, top_px


def _limits(surface: Surface, turn: Attitude) -> tuple[float, ...]:
    """Bearings of the outer edges, angles below the horizon of the upper and lower one, rad."""
    if turn != LEVEL:
        return _turned_limits(surface, turn)
    x = surface.center_x_px
    bearings = [(edge - x) / surface.focal_px for edge in (-0.5, surface.width - 0.5)]
    if not surface.yaw_is_column_shift:
        bearings = [atan(bearing) for bearing in bearings]
    rays = [surface.rays(x, edge) for edge in (-0.5, surface.height - 0.5)]
    return *bearings, *(atan2(down, hypot(right, ahead)) for right, down, ahead in rays)


def _turned_limits(surface: Surface, turn: Attitude) -> tuple[float, ...]:
    """The same of what a panorama covers that is turned."""
    x = np.linspace(-0.5, surface.width - 0.5, _BORDER_POINTS)
    y = np.linspace(-0.5, surface.height - 0.5, _BORDER_POINTS)
    border = [surface.rays(x, edge) for edge in (y[0], y[-1])]
    border += [surface.rays(edge, y) for edge in (x[0], x[-1])]
    plain = np.concatenate(border)
    level = plain @ turn.matrix.T
    before, after = (np.arctan2(rays[:, 0], rays[:, 2]) for rays in (plain, level))
    if surface.yaw_is_column_shift:
        columns = np.concatenate([x, x, np.repeat(x[[0, -1]], len(y))])
        before_full = (columns - surface.center_x_px) / surface.focal_px
    else:
        before_full = before
    # How far a bearing is turned is less than half around.
    bearings = before_full + (after - before + pi) % (2 * pi) - pi
    down = np.arctan2(level[:, 1], np.hypot(level[:, 0], level[:, 2]))
    return tuple(
        float(limit) for limit in (bearings.min(), bearings.max(), down.min(), down.max())
    )


def with_xmp(jpeg: bytes, tags: dict[str, object]) -> bytes:
    """Put GPano tags into a JPEG, behind its JFIF header."""
    lines = '\n'.join(f'        GPano:{name}="{value}"' for name, value in tags.items())
    segment = _XMP_NAMESPACE + _XMP.format(tags=lines).encode()
    behind = 4 + int.from_bytes(jpeg[4:6], 'big')
    app1 = b'\xff\xe1' + (len(segment) + 2).to_bytes(2, 'big') + segment
    return jpeg[:behind] + app1 + jpeg[behind:]
