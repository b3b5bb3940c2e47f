"""What exists works on views: a detector finds a rendered tag, straight lines are straight."""

import os
from functools import lru_cache

import cv2
import numpy as np
import pytest

from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude, angle_between
from fisheye_geometry.rig import Rig, RigCamera
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.compose.virtual_camera import VirtualCamera
from panorama_stitch.compose.virtual_view import VirtualView
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings


def deg(*angles):
    return Attitude(*np.radians(angles))


def camera_at(yaw_deg, pitch_deg, hfov_deg, size):
    return VirtualCamera(*np.radians((yaw_deg, pitch_deg, hfov_deg)), *size)


LENS = synthetic_lens(960, 720, np.radians(170))
MOUNTS = deg(-70, -4, 2), deg(70, -4, -3)
SIDE_M, AWAY_M = 0.5, 1.6
POSE_DEG, DISTANCE_SHARE = 1.0, 0.02
STRAIGHT_PX = 0.5
SAMPLES = 2
"""A pixel is the mean of so many rays a side."""
GREY = 150
CELLS = 8
"""A tag of the family 36h11, its black border among them; one cell of white is around it."""


def tag_picture():
    """Return tag 7 of the family tag36h11 with white around it, (10, 10) uint8."""
    aruco = pytest.importorskip('cv2.aruco')
    family = aruco.getPredefinedDictionary(aruco.DICT_APRILTAG_36h11)
    draw = getattr(aruco, 'generateImageMarker', None) or aruco.drawMarker
    # OpenCV draws these tags upside down.
    tag = np.ascontiguousarray(draw(family, 7, CELLS)[::-1, ::-1])
    return cv2.copyMakeBorder(tag, *[1] * 4, cv2.BORDER_CONSTANT, value=255)


@lru_cache
def rays():
    """Return unit rays (height * n, width * n, 3) of samples within the pixels of the lens."""
    step = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    x, y = ((np.arange(side)[:, None] + step).ravel() for side in (LENS.width, LENS.height))
    unit, seen = LENS.unproject(np.stack(np.meshgrid(x, y), axis=-1))
    return np.where(seen[..., None], unit, 0).astype(np.float32)


def rendered(mount, shade):
    """Return what a camera sees of a world: `shade` gives the grey of rays (..., 3) of the rig."""
    grey = shade(rays() @ mount.matrix.T.astype(np.float32)) * rays().any(axis=-1)
    size = LENS.width, LENS.height
    image = cv2.resize(grey.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    return cv2.cvtColor(image.round().astype(np.uint8), cv2.COLOR_GRAY2BGR)


def view_of(images, camera, *, moves):
    cameras = tuple(RigCamera(*e) for e in zip(('left', 'right'), [LENS] * 2, MOUNTS, strict=True))
    surface = PanoramaSettings().surface_of(LENS)
    compositor = build_compositor(views_of_rig(Rig(cameras), [surface] * 2), images, Style())
    out = np.empty((camera.height, camera.width, 3), np.uint8)
    VirtualView(compositor, camera.surface, camera.attitude, moves=moves).draw(images, out)
    return cv2.cvtColor(out, cv2.COLOR_BGR2GRAY)


def pose(bearing_deg, height_deg):
    """Return a tag's rotation (3, 3) and place (3,) in the rig: aslant, so that it is telling."""
    towards = deg(bearing_deg, height_deg, 0).matrix
    return towards @ deg(28, -15, 10).matrix, AWAY_M * towards[:, 2]


def tag_shade(rotation, place):
    """Return what shows the tag on grey, for `rendered`."""
    picture = tag_picture().astype(float)
    edge_m = SIDE_M * len(picture) / CELLS

    def shade(rays):
        grey = np.full(rays.shape[:-1], float(GREY))
        near = rays @ (place / AWAY_M).astype(np.float32) > 0.9
        x, y, z = (rays[near] @ rotation).T
        corner = place @ rotation
        along = corner[2] / z
        u = ((x * along - corner[0]) / edge_m + 0.5) * len(picture)
        v = ((y * along - corner[1]) / edge_m + 0.5) * len(picture)
        inside = (along > 0) & (u >= 0) & (v >= 0) & (u < len(picture)) & (v < len(picture))
        cell = np.where(inside, v, 0).astype(int), np.where(inside, u, 0).astype(int)
        grey[near] = np.where(inside, picture[cell], GREY)
        return grey

    return shade


@pytest.fixture(scope='module')
def detector():
    if os.environ.get('REQUIRE_DETECTOR') != '1':
        pytest.importorskip('pupil_apriltags')
    import pupil_apriltags

    return pupil_apriltags.Detector(families='tag36h11')


@pytest.mark.parametrize(
    ('bearing_deg', 'height_deg'),
    [(-140, 0), (-62, 12), (0, 0), (3, 8), (142, -5)],
)
def test_a_detector_finds_the_pose_of_a_tag_wherever_it_is(detector, bearing_deg, height_deg):
    rotation, place = pose(bearing_deg, height_deg)
    images = [rendered(mount, tag_shade(rotation, place)) for mount in MOUNTS]
    away_deg = 11 if bearing_deg < 0 else -11  # not in the middle of the view
    camera = camera_at(bearing_deg + away_deg, height_deg / 2, 80, (800, 600))
    k = camera.lens.matrix
    numbers = k[0, 0], k[1, 1], k[0, 2], k[1, 2]
    for moves in (False, True):
        (found,) = detector.detect(view_of(images, camera, moves=moves), True, numbers, SIDE_M)
        assert found.tag_id == 7
        back = camera.attitude.matrix
        assert np.degrees(angle_between(back @ found.pose_R, rotation)) < POSE_DEG
        offset_m = np.linalg.norm(back @ found.pose_t.ravel() - place)
        assert offset_m < DISTANCE_SHARE * AWAY_M


@pytest.mark.parametrize('yaw_deg', [-90, 0, 100])
def test_straight_lines_are_straight(yaw_deg):
    camera = camera_at(yaw_deg, -10, 90, (800, 600))
    # Planes through the rig: each is a line in any picture without distortion.
    normals = [
        deg(yaw_deg, -10, roll).matrix @ Attitude(pitch_rad=np.radians(up)).matrix[:, 1]
        for roll, up in ((0, 15), (8, -20), (-35, 0), (80, 5))
    ]

    def shade(rays):
        return GREY + 80 * np.prod([np.sign(rays @ normal) for normal in normals], axis=0)

    images = [rendered(mount, shade) for mount in MOUNTS]
    for moves in (False, True):
        check_lines(view_of(images, camera, moves=moves), camera, normals)


def check_lines(grey, camera, normals):
    plane = camera.surface
    for normal in normals:
        a, b, c = camera.attitude.matrix.T @ normal
        # a (x - cx) + b (y - cy) + c f = 0: look for the edge across it.
        along = np.array([-b, a]) / np.hypot(a, b)
        across = np.array([a, b]) / np.hypot(a, b)
        middle = np.array([plane.center_x_px, plane.center_y_px]) - across * (
            c * plane.focal_px / np.hypot(a, b)
        )
        offsets = [edge_px(grey, middle + t * along, across) for t in np.arange(-380, 380, 9)]
        offsets = np.array([each for each in offsets if each is not None])
        assert len(offsets) > 25
        assert np.abs(offsets).max() < STRAIGHT_PX


def edge_px(grey, at, across, reach=6):
    """Return how far from a point the edge across it is; None where it is not the only one."""
    height, width = grey.shape
    steps = np.arange(-reach, reach + 0.25, 0.25)
    x, y = (at + steps[:, None] * across).T
    if min(x.min(), y.min()) < 0 or x.max() > width - 1 or y.max() > height - 1:
        return None
    line = cv2.remap(grey, x[None].astype(np.float32), y[None].astype(np.float32), 1)
    line = line.ravel().astype(float)
    low, high = line[:4].mean(), line[-4:].mean()
    side = (line > (low + high) / 2).astype(int)
    if abs(high - low) < 120 or np.abs(np.diff(side)).sum() != 1 or abs(line[6:18].std()) > 60:
        return None
    return float(steps[np.flatnonzero(np.diff(side))[0]]) + 0.125
