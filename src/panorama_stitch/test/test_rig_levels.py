"""Rigs as they are mounted: levelled by what is known, drawn by mounts where nothing is found."""

import re
from dataclasses import replace

import cv2
import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude, angle_between
from fisheye_geometry.level import LEVELS, Mount
from panorama_stitch.overlap.overlap_result import Overlap, with_offset
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState

LENS = synthetic_lens(480, 360, np.radians(170))
SETTINGS = PanoramaSettings()
LEVEL_DEG = 0.3
"""Demanded of the horizon of a rendered scene."""
YAW_DEG = 0.3


def deg(*angles):
    return Attitude(*np.radians(angles))


def seen(*attitudes):
    return [Scene().view(LENS, attitude).frame(0) for attitude in attitudes]


def rig_of(count, mounts=(), mask_files=()):
    rig = RigState([f'camera{i}' for i in range(count)], mounts, mask_files)
    for camera in rig.cameras:
        rig.place(camera, LENS, SETTINGS.surface_of(LENS))
    return rig


def measured(images, settings=SETTINGS, **known):
    rig = rig_of(len(images), **known)
    rig.overlaps = measure_overlaps(rig, [images], settings, 'particles')
    return rig


def attitudes(rig, settings=SETTINGS):
    """Return yaw, pitch and roll of each camera in the level frame, deg."""
    solved = rig.solution(rig.effective_overlaps(settings), settings).rig
    return [np.degrees(list(vars(camera.attitude).values())) for camera in solved.cameras]


TILTED = (deg(-70, -12, 0), deg(70, -12, 0))


def test_a_mount_that_looks_down_gets_a_straight_horizon():
    rig = measured(seen(*TILTED))
    for found, true in zip(attitudes(rig), TILTED, strict=True):
        assert found == pytest.approx(np.degrees(list(vars(true).values())), abs=LEVEL_DEG)
    (overlap,) = rig.overlaps
    yaw_px = np.radians(140) * SETTINGS.surface_of(LENS).focal_px
    assert overlap.offset_x_px == pytest.approx(yaw_px, abs=1.5)
    assert overlap.offset_y_px == pytest.approx(0.0, abs=1.5)


@pytest.mark.parametrize(('expected_deg', 'found'), [(141.0, True), (120.0, False)])
def test_an_expected_angle_is_one_about_the_vertical(expected_deg, found):
    settings = replace(SETTINGS, expected_yaw_deg=expected_deg, yaw_tolerance_deg=2.0)
    (overlap,) = measured(seen(*TILTED), settings).overlaps
    assert overlap.found == found
    if not found:
        angle_deg = re.search('looks (.*) degrees to the right, which', overlap.message)[1]
        assert float(angle_deg) == pytest.approx(140, abs=YAW_DEG)
        assert 'expected_yaw_deg of 120 and yaw_tolerance_deg of 2 forbid' in overlap.message


def test_level_first_takes_the_first_camera_for_level():
    rig = measured(seen(*TILTED))
    first, _ = attitudes(rig, replace(SETTINGS, level='first'))
    assert first[1:] == pytest.approx([0, 0], abs=1e-6)


def test_level_angles_come_on_top():
    rig = measured(seen(deg(-70, 0, 0), deg(70, 0, 0)))
    settings = replace(SETTINGS, level_yaw_deg=30.0)
    plain, turned = attitudes(rig), attitudes(rig, settings)
    for former, now in zip(plain, turned, strict=True):
        assert now - former == pytest.approx([30, 0, 0], abs=1e-6)


def test_the_imu_levels_a_rig_that_nods():
    nod = deg(0, -10, 0).matrix
    rig = measured(seen(*(Attitude.of(nod @ deg(yaw, 0, 0).matrix) for yaw in (-70, 70))))
    settings = replace(SETTINGS, level='imu')
    assert attitudes(rig, settings)[0][1] == pytest.approx(0, abs=LEVEL_DEG), 'symmetric so far'
    rig.gravity = nod.T @ (0.0, 1.0, 0.0)
    left, right = attitudes(rig, settings)
    true = np.degrees(list(vars(Attitude.of(nod @ deg(-70, 0, 0).matrix)).values()))
    assert left[1:] == pytest.approx(true[1:], abs=LEVEL_DEG)
    assert right[1] == pytest.approx(left[1], abs=LEVEL_DEG)


def test_a_ring_of_four_closes_and_is_360_degrees_wide():
    images = seen(*(deg(yaw, -5, 0) for yaw in (-135, -45, 45, 135)))
    rig = measured(images)
    assert len(rig.overlaps) == len(rig.pairs) == 4
    assert all(overlap.found for overlap in rig.overlaps)
    layout = rig.compositor(SETTINGS, images).layout
    assert layout.wraps
    assert layout.surface.width == round(2 * np.pi * layout.surface.focal_px)
    for found, yaw in zip(attitudes(rig), (-135, -45, 45, 135), strict=True):
        assert found == pytest.approx([yaw, -5, 0], abs=LEVEL_DEG)


def test_a_ring_that_is_declared_open_is_not_closed():
    images = seen(*(deg(yaw, 0, 0) for yaw in (-135, -45, 45, 135)))
    settings = replace(SETTINGS, ring='open')
    rig = measured(images, settings)
    assert len(rig.overlaps) == 3
    assert not rig.compositor(settings, images).layout.wraps


def test_mounts_stand_in_where_no_overlap_is_found():
    mounts = [Mount(*np.radians(angles)) for angles in ((-70, -5, 0), (70, -5, 0))]
    dark = [np.zeros((LENS.height, LENS.width, 3), np.uint8)] * 2
    rig = measured(dark, mounts=mounts)
    assert not rig.overlaps[0].found
    for found, yaw in zip(attitudes(rig), (-70, 70), strict=True):
        assert found == pytest.approx([yaw, -5, 0], abs=1e-6)
    (sentence,) = rig.solution(rig.overlaps, SETTINGS).messages
    assert 'no overlap of camera0 and camera1 was found; they are drawn as' in sentence


def test_upside_down_cameras_are_drawn_upright():
    images = seen(deg(-70, 0, 180), deg(70, 0, 180))
    mounts = [Mount(roll_rad=np.pi)] * 2
    for found, yaw in zip(attitudes(measured(images, mounts=mounts)), (-70, 70), strict=True):
        assert found[0] == pytest.approx(yaw, abs=YAW_DEG)
        assert found[1] == pytest.approx(0, abs=LEVEL_DEG)
        assert abs(found[2]) == pytest.approx(180, abs=LEVEL_DEG)


def test_one_camera_makes_a_panorama():
    images = seen(deg(0, 0, 0))
    rig = measured(images)
    assert rig.overlaps == []
    compositor = rig.compositor(SETTINGS, images)
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    compositor.compose(images, out)
    assert out.any(axis=2).mean() > 0.99


def test_a_mask_of_another_size_is_said_and_left_out(tmp_path):
    path = tmp_path / 'mask.png'
    cv2.imwrite(str(path), np.zeros((10, 10), np.uint8))
    rig = rig_of(2, mask_files=['', str(path)])
    assert list(rig.faults) == ['camera1']
    assert '10x10 px; expected 480x360 px' in rig.faults['camera1']
    assert rig.camera_views[1].body is None


def rig_that_looks(pitch_deg, settings=SETTINGS):
    """Return a rig of two cameras that look down as much, and what is measured of them."""
    left, right = deg(-70, pitch_deg, 0), deg(70, pitch_deg, 0)
    rig = rig_of(2)
    between = Attitude.of(left.matrix.T @ right.matrix)
    rig.overlaps = [Overlap('particles', True, attitude=between)]
    surfaces = rig.surfaces
    level = rig.solution(rig.overlaps, settings).rig.attitudes(rig.pairs[0])
    rig.overlaps = [with_offset(rig.overlaps[0], *surfaces, level)]
    return rig


PITCHES_DEG = (0.0, -8.0, -15.0, -25.0)


@pytest.mark.parametrize('pitch_deg', PITCHES_DEG)
@pytest.mark.parametrize('level', LEVELS)
def test_the_offset_that_is_told_changes_nothing_when_it_is_set(pitch_deg, level):
    settings = replace(SETTINGS, level=level)
    rig = rig_that_looks(pitch_deg, settings)
    (measured,) = rig.overlaps
    told = replace(
        settings, offset_x_px=(measured.offset_x_px,), offset_y_px=(measured.offset_y_px,)
    )
    (overlap,) = rig.effective_overlaps(told)
    assert overlap.method == 'manual'
    assert angle_between(overlap.attitude.matrix, measured.attitude.matrix) < 1e-9
    assert overlap.overlap_px == measured.overlap_px


@pytest.mark.parametrize('pitch_deg', PITCHES_DEG)
def test_an_offset_set_by_hand_turns_about_the_level_vertical(pitch_deg):
    rig = rig_that_looks(pitch_deg)
    focal_px, by_px = rig.surfaces[0].focal_px, 10.0
    settings = replace(SETTINGS, offset_x_px=(rig.overlaps[0].offset_x_px + by_px,))
    left, right = attitudes(rig, settings)
    assert left[1:] == pytest.approx([pitch_deg, 0], abs=1e-6)
    assert right[1:] == pytest.approx([pitch_deg, 0], abs=1e-6)
    assert right[0] - left[0] == pytest.approx(140 + np.degrees(by_px / focal_px))
    (before,), (after,) = rig.overlaps, rig.effective_overlaps(settings)
    assert after.overlap_px == pytest.approx(before.overlap_px - by_px)


@pytest.mark.parametrize('pitch_deg', PITCHES_DEG)
def test_a_vertical_offset_set_by_hand_moves_the_right_horizon(pitch_deg):
    rig = rig_that_looks(pitch_deg)
    (measured,) = rig.overlaps
    settings = replace(SETTINGS, offset_y_px=(measured.offset_y_px + 1.0,))
    (overlap,) = rig.effective_overlaps(settings)
    turned_rad = angle_between(overlap.attitude.matrix, measured.attitude.matrix)
    row_rad = np.cos(np.radians(pitch_deg)) ** 2 / rig.surfaces[0].focal_px
    assert turned_rad == pytest.approx(row_rad, rel=0.01)


def test_an_offset_set_by_hand_turns_cameras_from_where_their_mounts_say():
    rig = rig_of(2, [Mount(*np.radians(angles)) for angles in ((-70, -15, 0), (70, -15, 0))])
    surface = rig.surfaces[0]
    settings = replace(SETTINGS, offset_x_px=(np.radians(130) * surface.focal_px,))
    left, right = attitudes(rig, settings)
    assert right[0] - left[0] == pytest.approx(130)
    assert (*left[1:], *right[1:]) == pytest.approx((-15, 0, -15, 0), abs=1e-6)


def test_views_agree_at_a_distance_on_request():
    rig = measured(seen(deg(-70, 0, 0), deg(70, 0, 0)))
    near = replace(SETTINGS, align_distance_m=2.0, baseline_m=0.1)
    far_yaw, near_yaw = (
        right[0] - left[0] for left, right in (attitudes(rig), attitudes(rig, near))
    )
    assert near_yaw - far_yaw == pytest.approx(np.degrees(0.1 / 2.0), abs=0.01)
