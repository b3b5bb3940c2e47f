"""Virtual cameras, against the scene drawn directly on their pictures."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from known_rigs import (
    BACK_TO_BACK,
    LENS,
    PAIR,
    RING,
    STAMP_NS,
    TILTED,
    WIDE,
    camera_at,
    drawn,
    rig_of,
)

from fisheye_capture.scene import Scene
from fisheye_core.errors import GeometryError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.rig import Rig, RigCamera
from fisheye_geometry.surface import Surface
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.compose.view import View
from panorama_stitch.compose.virtual_view import VirtualView
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings

FAITHFUL_DB = 30.0
"""As of the panorama: two bilinear resamplings of an antialiased scene stay well above it."""
RAY_DEG = 0.1
BLACK_SHARE = 0.03
A_STEP = 0.03
"""Of the brightness from column to column; the seam leans, so that it is none of 0.2 at once."""


def psnr(a, b, where=np.s_[:]):
    return 10 * np.log10(255**2 / max(np.mean((a.astype(float) - b)[where] ** 2), 1e-9))


def truth(camera):
    return Scene().view(camera.surface, camera.attitude).frame(STAMP_NS)


@pytest.fixture(scope='module')
def pair():
    return rig_of(PAIR)


@pytest.mark.parametrize('moves', [False, True])
@pytest.mark.parametrize('yaw_deg', [-105, 0, 8, 60])
@pytest.mark.parametrize('pitch_deg', [0, -25])
def test_it_shows_the_scene(pair, yaw_deg, pitch_deg, moves):
    camera = camera_at(yaw_deg, pitch_deg, 85, (400, 300))
    view, out = drawn(*pair, camera, moves=moves)
    assert view.seen_share > 1 - BLACK_SHARE
    lit = out.any(axis=2)
    assert psnr(out, truth(camera), lit) > FAITHFUL_DB


@pytest.mark.parametrize('blend', BLENDS)
def test_a_seam_has_the_blend_of_the_panorama(blend):
    compositor, images = rig_of(TILTED, blend=blend)
    images = [images[0], (images[1] * 0.8).astype(np.uint8)]
    camera = camera_at(5, -10)
    view, out = drawn(compositor, images, camera)
    assert view.cameras == (0, 1)
    bright, expected = (image.sum(axis=(0, 2), dtype=float) for image in (out, truth(camera)))
    ratio = bright / expected
    assert ratio[:30].mean() == pytest.approx(1.0, abs=0.01)
    assert ratio[-30:].mean() == pytest.approx(0.8, abs=0.01)
    steepest = np.abs(np.diff(ratio)).max()
    assert (steepest > A_STEP) == (blend == 'none')


@pytest.mark.parametrize('moves', [False, True])
@pytest.mark.parametrize('turn_deg', [0, 180, -180])
def test_cameras_meet_at_the_seam_where_an_open_panorama_reaches_past_180_degrees(turn_deg, moves):
    turned = [replace(each, yaw_rad=each.yaw_rad + np.radians(turn_deg)) for each in PAIR]
    compositor, images = rig_of(turned)
    surface, ((begin, end),) = compositor.layout.surface, compositor.layout.seams
    images = [images[0], (images[1] * 0.8).astype(np.uint8)]
    seam_rad = ((begin + end - 1) / 2 - surface.center_x_px) / surface.focal_px
    camera = camera_at(np.degrees(seam_rad), 0, 20, (320, 240))
    out = drawn(compositor, images, camera, moves=moves)[1]
    bright, expected = (image.sum(axis=(0, 2), dtype=float) for image in (out, truth(camera)))
    parts = np.s_[:140], np.s_[150:170], np.s_[180:]
    ratios = [bright[part].sum() / expected[part].sum() for part in parts]
    assert ratios == pytest.approx([1.0, 0.9, 0.8], abs=0.03)


@pytest.mark.parametrize('attitudes', [RING, BACK_TO_BACK], ids=['ring', 'back to back'])
@pytest.mark.parametrize('moves', [False, True])
def test_all_around_there_is_no_end(attitudes, moves):
    lens = LENS if len(attitudes) > 2 else WIDE
    compositor, images = rig_of(attitudes, is_closed=True, lens=lens)
    for yaw_deg in range(-180, 180, 60):
        camera = camera_at(yaw_deg, 0, 80, (320, 160))
        view, out = drawn(compositor, images, camera, moves=moves)
        assert view.seen_share == 1
        assert psnr(out, truth(camera)) > FAITHFUL_DB, yaw_deg


def test_a_ray_by_the_lens_and_the_attitude_is_the_panoramas_bearing(pair):
    compositor, _ = pair
    panorama = compositor.layout.surface
    for yaw_deg in (-120, -40, 0, 60, 150):
        camera = camera_at(yaw_deg, -15, 100)
        rays, _ = camera.lens.unproject(np.array([[0, 0], [320, 240], [639, 10], [100, 479.0]]))
        of_plane = camera.surface.rays(*np.array([[0, 0], [320, 240], [639, 10], [100, 479.0]]).T)
        for ray in (rays, of_plane / np.linalg.norm(of_plane, axis=1)[:, None]):
            pixels, _ = panorama.project(ray @ camera.attitude.matrix.T)
            back = panorama.rays(*pixels.T)
            back /= np.linalg.norm(back, axis=1)[:, None]
            apart = np.degrees(
                np.arccos(np.clip((back @ camera.attitude.matrix * ray).sum(1), -1, 1))
            )
            assert apart.max() < RAY_DEG


def test_what_a_pixel_shows_is_what_the_panorama_shows_there(pair):
    compositor, images = pair
    panorama = compositor.layout.surface
    whole = np.empty((panorama.height, panorama.width, 3), np.uint8)
    compositor.compose(images, whole)
    for yaw_deg in (-100, 0, 75):
        camera = camera_at(yaw_deg, 5, 60)
        _, out = drawn(compositor, images, camera)
        back = Attitude.of(camera.attitude.matrix.T)
        again = RemapTable(panorama, camera.surface, 'linear', back)
        shift = shift_px(again(whole), out)
        assert np.degrees(np.hypot(*shift) / camera.surface.focal_px) < RAY_DEG


def shift_px(first, second):
    """Return by how much one picture lies beside another, (x, y)."""
    greys = [
        cv2.cvtColor(image, cv2.COLOR_BGR2GRAY).astype(np.float32) for image in (first, second)
    ]
    return cv2.phaseCorrelate(*greys, cv2.createHanningWindow(greys[0].shape[::-1], cv2.CV_32F))[0]


def test_black_is_where_nothing_is_seen(pair):
    view, out = drawn(*pair, camera_at(180, 0, 60))
    dark = ~out.any(axis=2)
    assert 0.4 < 1 - view.seen_share < 1
    assert dark.mean() == pytest.approx(1 - view.seen_share, abs=0.01)


def test_a_camera_that_is_silent_is_black(pair):
    compositor, images = pair
    _, out = drawn(compositor, images, camera_at(0), without=[1])
    assert not out[:, 400:].any()
    assert out[:, :240].any(axis=2).all()


def test_a_body_is_hidden_where_the_neighbour_sees_the_place():
    compositor, images = rig_of(PAIR)
    body = np.zeros(images[0].shape[:2], bool)
    camera = camera_at(-6, 0, 20, (320, 200))
    turned = camera.attitude.matrix.T @ PAIR[0].matrix
    pixels, _ = LENS.project(camera.surface.rays(100, 100) @ turned)
    x, y = np.rint(pixels).astype(int)
    body[y - 12 : y + 12, x - 12 : x + 12] = True
    without = drawn(compositor, images, camera)[1]
    images = [images[0].copy(), images[1]]
    images[0][body] = 0, 0, 255
    assert psnr(drawn(compositor, images, camera)[1], without) < FAITHFUL_DB
    views = [replace(compositor.views[0], body=body), compositor.views[1]]
    out = drawn(build_compositor(views, images, Style()), images, camera)[1]
    assert psnr(out, without) > FAITHFUL_DB


def test_grey_pictures_are_drawn_too(pair):
    compositor, images = pair
    grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images]
    camera = camera_at(20)
    out = drawn(compositor, grey, camera)[1]
    assert psnr(out, cv2.cvtColor(truth(camera), cv2.COLOR_BGR2GRAY)) > FAITHFUL_DB


def test_corrected_pictures_are_drawn_too(pair):
    _, images = pair
    surface = PanoramaSettings().surface_of(LENS)
    corrected = [View(LENS, surface).corrected(image) for image in images]
    cameras = tuple(RigCamera(str(i), surface, attitude) for i, attitude in enumerate(PAIR))
    seen = [image.any(axis=2) for image in corrected]
    views = views_of_rig(Rig(cameras), [surface] * 2, seen=seen)
    camera = camera_at(-10, 10)
    out = drawn(build_compositor(views, corrected, Style()), corrected, camera)[1]
    assert psnr(out, truth(camera)) > FAITHFUL_DB - 3, 'interpolated twice'


def test_frames_side_by_side_tell_no_bearings():
    compositor, _ = rig_of(PAIR)
    apart = [replace(view, shift_px=(100.0 * i, 0)) for i, view in enumerate(compositor.views)]
    compositor.views = tuple(apart)
    with pytest.raises(GeometryError, match='no overlap was found'):
        VirtualView(compositor, camera_at(0).surface, camera_at(0).attitude)


def test_a_plane_tells_no_bearings():
    compositor, _ = rig_of(PAIR)
    plane = Surface('rectilinear', 640, 480, 300.0, 319.5, 239.5)
    compositor.layout = replace(compositor.layout, surface=plane)
    with pytest.raises(GeometryError, match='expected surface:=cylindrical or equirectangular'):
        VirtualView(compositor, camera_at(0).surface, camera_at(0).attitude)
