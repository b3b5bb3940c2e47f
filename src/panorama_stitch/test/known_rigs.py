"""Rigs of which all is known, and virtual cameras in their panoramas."""

import numpy as np

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.rig import Rig, RigCamera
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.compose.virtual_camera import VirtualCamera
from panorama_stitch.compose.virtual_view import VirtualView
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

LENS = synthetic_lens(640, 480, np.radians(170))
STAMP_NS = 700_000_000


def deg(*angles):
    return Attitude(*np.radians(angles))


PAIR = deg(-70, 0, 0), deg(70, 0, 0)
TILTED = deg(-70, -12, 3), deg(70, -12, -4)
RING = tuple(deg(yaw, -5, 0) for yaw in (-135, -45, 45, 135))
BACK_TO_BACK = deg(-90, 0, 0), deg(90, 0, 0)
WIDE = synthetic_lens(640, 480, np.radians(210))


def rig_of(attitudes, *, is_closed=False, lens=LENS, **style):
    """Return what composes the panoramas of a known rig, and its pictures."""
    names = [f'camera{index}' for index in range(len(attitudes))]
    cameras = tuple(
        RigCamera(*each) for each in zip(names, [lens] * len(names), attitudes, strict=True)
    )
    surface = PanoramaSettings().surface_of(lens)
    views = views_of_rig(Rig(cameras, is_closed), [surface] * len(names))
    images = [Scene().view(lens, attitude).frame(STAMP_NS) for attitude in attitudes]
    return build_compositor(views, images, Style(**style), wraps=is_closed), images


def camera_at(yaw_deg, pitch_deg=0.0, hfov_deg=90.0, size=(640, 480)):
    return VirtualCamera(*np.radians((yaw_deg, pitch_deg, hfov_deg)), *size)


def drawn(compositor, images, camera, **options):
    moves = options.pop('moves', False)
    view = VirtualView(compositor, camera.surface, camera.attitude, moves=moves)
    out = np.full((camera.height, camera.width, *images[0].shape[2:]), 77, np.uint8)
    view.draw(images, out, **options)
    return view, out
