"""Settings of the two nodes that make panoramas: the only place with their defaults."""

from dataclasses import dataclass
from math import isnan, nan, radians

from fisheye_capture.capture_settings import FrameSettings
from fisheye_core.errors import SettingError
from fisheye_core.settings import setting
from fisheye_core.video_settings import VideoSettings
from fisheye_geometry.level import LEVELS, Mount
from fisheye_geometry.rig import MAX_CAMERAS, RINGS
from fisheye_undistort.undistort_settings import SurfaceSettings
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.layout import CROPS
from panorama_stitch.overlap.overlap_settings import OverlapSettings
from panorama_stitch.pipeline.view_settings import ViewNames, check_names


@dataclass(frozen=True)
class PanoramaOutputSettings(ViewNames, OverlapSettings, VideoSettings):
    """What both nodes that make panoramas can be told; all that the stitch node can."""

    cameras: tuple[str, ...] = setting(
        ('left', 'right'),
        'Names of the cameras, from left to right: the namespaces of their topics.',
    )
    auto_calibrate: bool = setting(
        True, 'Measure the overlap on the first good pair of frames.', live=True
    )
    offset_x_px: tuple[float, ...] = setting(
        (nan,),
        'Offset set by hand, px, one number for each neighbouring pair; NaN: measured.',
        nan=True,
        live=True,
    )
    offset_y_px: tuple[float, ...] = setting(
        (nan,),
        'Vertical offset set by hand, px, one number for each neighbouring pair; NaN: measured.',
        nan=True,
        live=True,
    )
    overlap_file: str = setting(
        '', 'YAML file with the overlap: read at start, written on request.'
    )
    blend: str = setting(
        'flow',
        'How neighbours meet: none lays the right over the left as published, feather fades, '
        'multiband fades coarse detail over a wider strip than fine detail, flow warps both until '
        'near things meet.',
        choices=tuple(BLENDS),
        live=True,
    )
    feather_deg: float = setting(
        2.0,
        'Width of the fade at a seam; multiband takes four times as much for coarse detail.',
        minimum=0.1,
        maximum=60.0,
        live=True,
    )
    gain_compensation: bool = setting(
        True, 'Make the cameras equally bright, as measured where they overlap.', live=True
    )
    crop: str = setting(
        'valid',
        'valid keeps the rows and columns that hold a picture everywhere, none keeps all.',
        choices=CROPS,
        live=True,
    )
    pair_by: str = setting(
        'stamp',
        'How frames are matched: by their stamps, or by when they arrive, for cameras '
        'whose clocks differ.',
        choices=('stamp', 'arrival'),
        live=True,
    )
    max_pair_skew_s: float = setting(
        0.1,
        'Frames whose stamps differ by more do not form a pair.',
        minimum=0.0,
        maximum=10.0,
        live=True,
    )
    stale_after_s: float = setting(
        0.5,
        'A camera that gave no frame for so long, and for 2.5 periods, is stale.',
        minimum=0.05,
        maximum=60.0,
        live=True,
    )
    ring: str = setting(
        'auto',
        'Whether the last camera meets the first: auto as they show, open never, closed for sure.',
        choices=RINGS,
        live=True,
    )
    level: str = setting(
        'symmetric',
        'What is level: symmetric where the outer cameras pitch and roll alike, first the first '
        'camera, imu as gravity on the topic imu says, none as the cameras are mounted.',
        choices=LEVELS,
        live=True,
    )
    level_yaw_deg: float = setting(
        0.0,
        'Turns the level panorama to the right, deg.',
        minimum=-180.0,
        maximum=180.0,
        live=True,
    )
    level_pitch_deg: float = setting(
        0.0, 'Turns the level panorama up, deg.', minimum=-90.0, maximum=90.0, live=True
    )
    level_roll_deg: float = setting(
        0.0, 'Turns the level panorama clockwise, deg.', minimum=-180.0, maximum=180.0, live=True
    )
    align_distance_m: float = setting(
        0.0,
        'Distance at which neighbouring views are made to agree, given baseline_m; 0: far away.',
        minimum=0.0,
        maximum=1000.0,
        live=True,
    )
    baseline_m: float = setting(
        0.0,
        'Distance between neighbouring lenses, for align_distance_m; 0: not known.',
        minimum=0.0,
        maximum=10.0,
        live=True,
    )
    jpeg_quality: int = setting(
        80, 'Quality of the compressed panorama.', minimum=1, maximum=100, live=True
    )

    def __post_init__(self):
        """Refuse names and numbers that do not belong together."""
        cameras, pairs = self.cameras, len(self.cameras) - 1
        if not 1 <= len(cameras) <= MAX_CAMERAS or len(set(cameras)) != len(cameras):
            raise SettingError(
                f'cameras is {list(cameras)}; expected 1 to {MAX_CAMERAS} different names'
            )
        check_names('cameras', cameras)
        self.check_views(cameras)
        for name in ('offset_x_px', 'offset_y_px'):
            values = getattr(self, name)
            if len(values) != pairs and not all(map(isnan, values)):
                raise SettingError(
                    f'{name} has {len(values)} numbers; expected {pairs}, one for each '
                    'neighbouring pair'
                )


@dataclass(frozen=True)
class MountSettings:
    """What is known of a camera before anything is seen; its parameters lie behind its name."""

    yaw_deg: float = setting(
        nan,
        'How far the camera is turned to the right, deg; NaN: not known.',
        minimum=-360.0,
        maximum=360.0,
        nan=True,
    )
    pitch_deg: float = setting(
        nan,
        'How far the camera is turned up, deg; NaN: not known.',
        minimum=-90.0,
        maximum=90.0,
        nan=True,
    )
    roll_deg: float = setting(
        nan,
        'How far the camera is turned clockwise as it sees it, deg (upside down: 180); NaN: not '
        'known.',
        minimum=-360.0,
        maximum=360.0,
        nan=True,
    )
    mask_file: str = setting(
        '', 'Image of the size of the camera, white where the camera sees the robot itself.'
    )

    @property
    def mount(self) -> Mount:
        """The angles."""
        return Mount(*map(radians, (self.yaw_deg, self.pitch_deg, self.roll_deg)))


@dataclass(frozen=True)
class PanoramaSettings(PanoramaOutputSettings, SurfaceSettings, FrameSettings):
    """Settings of the panorama node; those of each camera are `CameraSettings` behind its name."""
