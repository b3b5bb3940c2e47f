"""Settings of the correction: the only place with their defaults."""

from dataclasses import dataclass
from math import nan, radians

from fisheye_core.settings import setting
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import Lens
from fisheye_geometry.lens_surface import SCALES, surface_for
from fisheye_geometry.level import Mount
from fisheye_geometry.remap import INTERPOLATIONS
from fisheye_geometry.surface import SURFACES, Surface


@dataclass(frozen=True)
class SurfaceSettings:
    """What every node that corrects pictures can be told."""

    surface: str = setting(
        'cylindrical', 'Projection surface of the corrected pictures.', choices=SURFACES, live=True
    )
    interpolation: str = setting(
        'linear', 'How pixels are interpolated.', choices=INTERPOLATIONS, live=True
    )
    scale: str = setting(
        'preserve_area',
        'preserve_area keeps the scale of the middle of the picture, fit the size of the picture.',
        choices=SCALES,
        live=True,
    )
    hfov_deg: float = setting(
        0.0,
        'Horizontal field of view of a corrected picture; 0: what the lens sees across it.',
        minimum=0.0,
        maximum=359.0,
        live=True,
    )
    vfov_deg: float = setting(
        0.0,
        'Vertical field of view of a corrected picture; 0: all that the frame holds.',
        minimum=0.0,
        maximum=179.0,
        live=True,
    )
    transport: str = setting(
        'raw',
        'How pictures of topics are taken: raw, as JPEG (compressed), or as H.264 (video).',
        choices=('raw', 'compressed', 'video'),
    )

    def surface_of(self, lens: Lens) -> Surface:
        """Return the surface on which a camera's pictures are corrected."""
        width, height = self._size
        return surface_for(
            lens,
            self.surface,
            scale=self.scale,
            hfov_rad=radians(self.hfov_deg),
            vfov_rad=radians(self.vfov_deg),
            width=width,
            height=height,
            attitude=self.tilt,
        )

    @property
    def tilt(self) -> Attitude:
        """Attitude of the camera in the frame of its corrected picture."""
        return LEVEL

    @property
    def _size(self) -> tuple[int, int]:
        """Width and height that are asked for, px; 0: from the scale."""
        return 0, 0


@dataclass(frozen=True)
class UndistortSettings(SurfaceSettings):
    """Settings of the undistort node."""

    width: int = setting(
        0,
        'Width of the corrected picture, px; 0: from the scale.',
        minimum=0,
        maximum=8192,
        live=True,
    )
    height: int = setting(
        0,
        'Height of the corrected picture, px; 0: from the scale.',
        minimum=0,
        maximum=8192,
        live=True,
    )

    yaw_deg: float = setting(
        nan,
        'How far the camera is turned to the right; NaN: not known. It is told in projection.',
        minimum=-360.0,
        maximum=360.0,
        nan=True,
        live=True,
    )
    pitch_deg: float = setting(
        nan,
        'How far the camera is turned up, taken out of the corrected picture; NaN: not known.',
        minimum=-90.0,
        maximum=90.0,
        nan=True,
        live=True,
    )
    roll_deg: float = setting(
        nan,
        'How far the camera is turned clockwise as it sees it (upside down: 180), taken out of '
        'the corrected picture; NaN: not known.',
        minimum=-360.0,
        maximum=360.0,
        nan=True,
        live=True,
    )

    @property
    def tilt(self) -> Attitude:
        """Attitude of the camera in the frame of its corrected picture, which is level."""
        return Mount(0.0, radians(self.pitch_deg), radians(self.roll_deg)).attitude

    @property
    def orientation(self) -> Attitude:
        """Attitude of the corrected picture in the level frame in which the camera is mounted."""
        return Mount(radians(self.yaw_deg), 0.0, 0.0).attitude

    @property
    def _size(self) -> tuple[int, int]:
        return self.width, self.height
