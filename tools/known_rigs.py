"""Rigs of synthetic cameras, and what is known of rigs in folders."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians
from pathlib import Path

import numpy as np

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.rig import pairs_of

SYNTHETIC_RIGS: dict[str, dict[str, tuple[float, float, float]]] = {
    'pair': {'left': (-70, 0, 0), 'right': (70, 0, 0)},
    'tilted': {'left': (-70, -12, 0), 'right': (70, -12, 0)},
    'one_upside_down': {'left': (-60, 0, 0), 'right': (60, 0, 180)},
    'ring3': {'left': (-120, 0, 0), 'front': (0, 0, 0), 'right': (120, 0, 0)},
    'ring4': {
        'rear_left': (-135, -5, 0),
        'front_left': (-45, -5, 0),
        'front_right': (45, -5, 0),
        'rear_right': (135, -5, 0),
    },
    'back_to_back': {'left': (-90, 0, 0), 'right': (90, 0, 0)},
}
"""Yaw, pitch and roll of each camera, deg, from left to right."""
_FOV_DEG = {'back_to_back': 210.0}
"""Fields of view that are not the usual one."""


@dataclass(frozen=True)
class KnownRig:
    """A rig of cameras, as it is started.

    Attributes
    ----------
    cameras
        The parameters of each camera's capture, by its name, from left to right.
    common
        The parameters of all of them.
    attitudes
        Of each camera in the level frame; () where they are not known.
    offset_deg
        What the offset of the only pair is, where that is all that is known.
    is_closed
        Whether the last camera meets the first.
    """

    cameras: dict[str, dict[str, object]]
    common: dict[str, object]
    attitudes: tuple[Attitude, ...] = ()
    offset_deg: float | None = None
    is_closed: bool = False

    def between(self) -> list[Attitude]:
        """Return the angle between the axes of each pair, level, and the right camera's tilt.

        Pitch and roll are those in the frame of the left camera, as an overlap has them.
        """
        result = []
        for left, right in pairs_of(len(self.attitudes), self.is_closed):
            one, other = self.attitudes[left], self.attitudes[right]
            tilt = Attitude.of(one.matrix.T @ other.matrix)
            yaw_rad = (other.yaw_rad - one.yaw_rad) % (2 * pi)
            result.append(Attitude(yaw_rad, tilt.pitch_rad, tilt.roll_rad))
        return result


def synthetic_rig(name: str) -> KnownRig:
    """Return a rig of `SYNTHETIC_RIGS`."""
    angles = SYNTHETIC_RIGS[name]
    cameras = {
        camera: {
            'synthetic_yaw_deg': float(yaw),
            'synthetic_pitch_deg': float(pitch),
            'synthetic_roll_deg': float(roll),
        }
        for camera, (yaw, pitch, roll) in angles.items()
    }
    common = {'synthetic_fov_deg': _FOV_DEG[name]} if name in _FOV_DEG else {}
    attitudes = tuple(Attitude(*map(radians, each)) for each in angles.values())
    return KnownRig(cameras, common, attitudes, is_closed=name.startswith(('ring', 'back')))


def folder_rig(folder: Path, cameras: Sequence[str] = ()) -> KnownRig:
    """Return the rig whose images and calibrations a folder holds, with what truth.json knows.

    Without one the cameras stand in the order of their names.

    Parameters
    ----------
    folder
        Holds NAME.png and NAME.yaml of each camera, and maybe other files.
    cameras
        Names from left to right; they do without truth.json.

    Raises
    ------
    FileNotFoundError
        If the folder holds no camera, or an image or a calibration is missing.
    """
    path = folder / 'truth.json'
    truth = {'cameras': cameras}
    if not cameras and path.is_file():
        truth = json.loads(path.read_text())
    pictures = sorted(folder.glob('*.png'))
    names = truth.get('cameras') or [
        picture.stem for picture in pictures if picture.with_suffix('.yaml').is_file()
    ]
    files = [folder / f'{name}.{suffix}' for name in names for suffix in ('png', 'yaml')]
    missing = [str(file) for file in files if not file.is_file()]
    if missing or not names:
        raise FileNotFoundError(
            f'{missing[0] if missing else folder / "*.png"} is not there; expected .png and '
            '.yaml of each camera'
        )
    attitudes = truth.get('attitude', {})
    return KnownRig(
        {
            name: {
                'source': str(folder / f'{name}.png'),
                'camera_info_url': str(folder / f'{name}.yaml'),
            }
            for name in names
        },
        {},
        tuple(Attitude.of(np.reshape(attitudes[name], (3, 3))) for name in names if attitudes),
        truth.get('offset_deg') if truth.get('overlaps') else None,
        bool(truth.get('closed')),
    )
