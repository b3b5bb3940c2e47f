"""Settings of the views, the virtual cameras: the only place with their defaults."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan, radians

from fisheye_core.errors import SettingError
from fisheye_core.settings import setting
from fisheye_geometry.rig import CAMERA_NAME
from panorama_stitch.compose.virtual_camera import VirtualCamera

MAX_VIEWS = 8
_MAX_LETTERS = 100
"""Of a name: DDS takes topics of up to 255."""
_YAWS_DEG = {'left': -90.0, 'right': 90.0, 'rear': 180.0, 'back': 180.0}
"""Where views look whose names begin so, if nothing else is said."""


def check_names(setting_name: str, names: Sequence[str]) -> None:
    """Raise a `SettingError` for a name that a setting has and that is no namespace."""
    for name in names:
        if not CAMERA_NAME.fullmatch(name) or len(name) > _MAX_LETTERS:
            raise SettingError(
                f"{setting_name} has '{name}'; expected a letter, then letters, digits or _, up "
                f'to {_MAX_LETTERS} in all'
            )


@dataclass(frozen=True)
class ViewNames:
    """Which views there are."""

    views: tuple[str, ...] = setting(
        (),
        'Names of up to 8 views: virtual cameras without distortion, each with its own image_raw '
        'and camera_info, drawn while somebody subscribes.',
        live=True,
    )

    def check_views(self, cameras: Sequence[str]) -> None:
        """Raise a `SettingError` for names that cannot be."""
        views = self.views
        if len(views) > MAX_VIEWS:
            raise SettingError(f'views has {len(views)} names; expected up to {MAX_VIEWS}')
        if len(set(views)) != len(views):
            raise SettingError(f'views is {list(views)}; expected different names')
        check_names('views', views)
        for name in views:
            if name in (*cameras, 'panorama'):
                raise SettingError(
                    f"views has '{name}', whose topics are those of "
                    f'{"a camera" if name in cameras else "the panorama"} already; expected '
                    f"another name, such as '{name}_view'"
                )


@dataclass(frozen=True)
class ViewSettings:
    """Where a view looks; its parameters lie behind its name."""

    yaw_deg: float = setting(
        nan,
        'Where the view looks, deg, positive to the right; NaN: by its name -90 for left..., 90 '
        'for right..., 180 for rear... and back..., 0 for any other.',
        minimum=-360.0,
        maximum=360.0,
        nan=True,
        live=True,
    )
    pitch_deg: float = setting(
        0.0, 'How far the view looks up, deg.', minimum=-90.0, maximum=90.0, live=True
    )
    hfov_deg: float = setting(
        90.0,
        'Horizontal field of view, from edge to edge, deg.',
        minimum=1.0,
        maximum=170.0,
        live=True,
    )
    width: int = setting(640, 'Width of the picture, px.', minimum=16, maximum=4096, live=True)
    height: int = setting(480, 'Height of the picture, px.', minimum=16, maximum=4096, live=True)
    stabilise: bool = setting(
        False,
        'Keep the view level while the robot nods and rolls, by level:=imu.',
        live=True,
    )

    def camera(self, name: str) -> VirtualCamera:
        """Return the virtual camera of a view of that name."""
        by_name = (yaw for begin, yaw in _YAWS_DEG.items() if name.startswith(begin))
        yaw_deg = next(by_name, 0.0) if isnan(self.yaw_deg) else self.yaw_deg
        return VirtualCamera(
            radians(yaw_deg),
            radians(self.pitch_deg),
            radians(self.hfov_deg),
            self.width,
            self.height,
        )
