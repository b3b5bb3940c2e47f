"""The whole measurement, on views that are drawn so that the truth is known."""

from dataclasses import replace

import numpy as np
import pytest
from seeing import LENS, apart_deg, see, turned, world

from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import RemapTable
from panorama_stitch.overlap.measure import measure_rotation
from panorama_stitch.overlap.overlap_result import aligned_at
from panorama_stitch.overlap.view import OverlapView

RIGHT_DEG = 0.5
"""What an operator sees as a step in the panorama."""
SHARP_DEG = 0.15
"""A third of a pixel of these small pictures."""
YAW = 130.0


def pair(left, right, **how):
    around = world(1)
    return see(around, left, **how), see(around, right, seed=1, **how)


@pytest.mark.parametrize(
    ('left', 'right'),
    [
        (turned(yaw=-YAW / 2), turned(yaw=YAW / 2)),
        (turned(yaw=-YAW / 2, pitch=-20), turned(yaw=YAW / 2, pitch=-20)),
        (turned(yaw=-YAW / 2, pitch=8, roll=-5), turned(yaw=YAW / 2, pitch=-6, roll=7)),
        (turned(yaw=-YAW / 2, roll=180), turned(yaw=YAW / 2, roll=180)),
        (turned(yaw=-YAW / 2), turned(yaw=YAW / 2, roll=180)),
        (turned(yaw=-YAW / 2, roll=90), turned(yaw=YAW / 2, roll=90)),
    ],
    ids=['level', 'down', 'askew', 'upside down', 'one upside down', 'on their side'],
)
def test_any_rotation_is_found_without_being_told(left, right):
    result = measure_rotation([pair(left, right)])
    assert result.found
    assert apart_deg(result.rotation, left.inv() * right) < SHARP_DEG


def test_a_near_post_does_not_move_the_far_scene():
    left, right = turned(yaw=-YAW / 2), turned(yaw=YAW / 2)
    around, post = world(2), (0.1, 1.2, 0.08)
    views = (
        see(around, left, (-0.05, 0.0, 0.0), post),
        see(around, right, (0.05, 0.0, 0.0), post, seed=1),
    )
    result = measure_rotation([views])
    assert apart_deg(result.rotation, left.inv() * right) < RIGHT_DEG
    parallax_deg = np.degrees(0.1 / 1.2)
    assert result.near_deg == pytest.approx(parallax_deg, rel=0.3)


def test_aligned_at_a_distance_brings_the_post_together():
    left, right = turned(yaw=-YAW / 2), turned(yaw=YAW / 2)
    far = measure_rotation([pair(left, right)])
    near = aligned_at(far.rotation.as_matrix(), distance_m=2.0, baseline_m=0.1)
    # A thing 2 m ahead of the middle of the rig, as either camera sees it.
    seen = [attitude.inv().apply([-x, 0.0, 2.0]) for attitude, x in ((left, -0.05), (right, 0.05))]
    seen = [ray / np.linalg.norm(ray) for ray in seen]
    assert np.degrees(np.linalg.norm(near @ seen[1] - seen[0])) < SHARP_DEG
    assert np.degrees(np.linalg.norm(far.rotation.apply(seen[1]) - seen[0])) > 2.0


def test_what_stays_at_its_pixels_is_no_witness():
    left, right = pair(turned(yaw=-YAW / 2), turned(yaw=YAW / 2))
    y, x = np.indices(left.image.shape)
    body = (y > 150) & (left.image > 0)
    pattern = np.where((x + y) // 9 % 2, 220, 30).astype(np.uint8)
    views = [OverlapView(np.where(body, pattern, one.image), LENS) for one in (left, right)]
    result = measure_rotation([tuple(views)])
    assert result.found
    assert apart_deg(result.rotation, turned(yaw=YAW)) < RIGHT_DEG


def test_a_masked_part_is_not_looked_at():
    left, right = pair(turned(yaw=-YAW / 2), turned(yaw=YAW / 2))
    masked = np.zeros(left.image.shape, bool)
    masked[:, left.image.shape[1] // 3 :] = True
    result = measure_rotation([(OverlapView(left.image, LENS, masked), right)])
    assert not result.found


def test_two_places_have_no_common_scene():
    result = measure_rotation(
        [(see(world(3), turned(yaw=-YAW / 2)), see(world(4), turned(yaw=YAW / 2), seed=1))]
    )
    assert not result.found
    assert result.limit != ''


def test_a_blank_picture_has_nothing_in_common():
    blank = OverlapView(np.full((240, 320), 90, np.uint8), LENS)
    result = measure_rotation([(blank, blank)])
    assert result.rotation is None or not result.found
    assert result.confidence < RIGHT_DEG


def test_corrected_pictures_are_a_source_like_raw_ones():
    views = pair(turned(yaw=-YAW / 2), turned(yaw=YAW / 2, pitch=5))
    surface = surface_for(LENS, 'cylindrical')
    table = RemapTable(LENS, surface)
    corrected = tuple(OverlapView(table(view.image), surface) for view in views)
    result = measure_rotation([corrected])
    assert apart_deg(result.rotation, turned(yaw=YAW) * turned(pitch=5)) < RIGHT_DEG


def test_an_expected_rotation_excludes_others():
    views = pair(turned(yaw=-YAW / 2), turned(yaw=YAW / 2))
    right = measure_rotation([views], expected=turned(yaw=YAW - 8), within_rad=np.radians(20))
    assert apart_deg(right.rotation, turned(yaw=YAW)) < SHARP_DEG
    wrong = measure_rotation([views], expected=turned(yaw=60), within_rad=np.radians(20))
    assert not wrong.found


def test_several_pairs_are_measured_together():
    around, left, right = world(5), turned(yaw=-YAW / 2), turned(yaw=YAW / 2)
    dim = 0.08 * (around - 128) + 60  # hardly above the noise
    pairs = [(see(dim, left, seed=2 * i), see(dim, right, seed=2 * i + 1)) for i in range(4)]
    alone, together = measure_rotation(pairs[:1]), measure_rotation(pairs)
    assert apart_deg(together.rotation, turned(yaw=YAW)) < RIGHT_DEG
    assert np.trace(together.covariance) < np.trace(alone.covariance)


def test_the_covariance_holds_the_error():
    left, right = turned(yaw=-YAW / 2), turned(yaw=YAW / 2, pitch=3)
    result = measure_rotation([pair(left, right)])
    error = (result.rotation * (left.inv() * right).inv()).as_rotvec()
    assert error @ np.linalg.solve(result.covariance, error) < 16.3  # 99.9 % of three numbers
    assert replace(result, found=False).votes > 50
