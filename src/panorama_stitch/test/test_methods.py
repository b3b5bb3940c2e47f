"""Overlap methods on constructed scenes, on pictures that must not fool it, and on real rigs."""

import json
from dataclasses import replace
from math import degrees, radians

import numpy as np
import pytest
from scenes import (
    YAW_DEG,
    exposed,
    lens,
    look,
    masked,
    pair,
    real_views,
    slats,
    tilted,
    world,
)

from fisheye_core.errors import OverlapError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.surface import SURFACES, Surface
from fisheye_testing.data import real_data
from panorama_stitch.overlap.corrected_overlap import measure_corrected
from panorama_stitch.overlap.methods import METHODS, CameraView, PairInput
from panorama_stitch.overlap.overlap_result import with_offset
from panorama_stitch.overlap.overlap_settings import METHODS as NAMES
from panorama_stitch.overlap.overlap_settings import OverlapSettings

SETTINGS = OverlapSettings()
ONE_PX = 1.0
RIG_DEG = 0.35
"""Demanded on real pictures, where parallax and tilt have their share."""
SHUN_DEG = 0.5
"""The same two cameras moved: their offset depends on how far the scene is."""
TILT_DEG = 0.3
NOISE = 6.0
REAL = ('apartment', 'bridge', 'city', 'dawn', 'forest', 'hall', 'lobby', 'park', 'workshop')
SHUN = tuple(f'shun74_{i}' for i in range(1, 6))


def measure_all(pairs, surfaces, method='particles', **changes):
    """Measure pairs of corrected images of which the left camera is level."""
    left, right = (CameraView(surface, surface) for surface in surfaces)
    overlap = METHODS[method](PairInput(left, right, pairs), replace(SETTINGS, **changes))
    if overlap.attitude is None:
        return overlap
    return with_offset(overlap, *surfaces, (LEVEL, overlap.attitude))


def measure(views, surfaces, method='particles', **changes):
    return measure_all([views], surfaces, method, **changes)


def test_the_names_in_the_settings_are_those_of_the_table():
    assert tuple(METHODS) == NAMES


@pytest.fixture(scope='module')
def town():
    return pair()


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
@pytest.mark.parametrize('method', ['particles', 'correlation'])
def test_finds_a_known_offset_in_spite_of_exposure_and_noise(kind, method):
    (left, right), surfaces, true_px = pair(kind)
    left, right = exposed(left, 1.0, NOISE), exposed(right, 0.7, NOISE, seed=8)
    overlap = measure((left, right), surfaces, method)
    assert overlap.found
    assert overlap.method == method
    assert overlap.offset_x_px == pytest.approx(true_px, abs=ONE_PX)
    assert overlap.offset_y_px == pytest.approx(0, abs=ONE_PX)
    assert overlap.overlap_px == pytest.approx(surfaces[0].width - true_px, abs=ONE_PX)
    assert overlap.confidence > SETTINGS.min_confidence
    assert f'{degrees(overlap.attitude.yaw_rad):.2f} degrees' in overlap.message


@pytest.mark.parametrize('size', [(320, 240), (1280, 960)])
def test_finds_it_at_any_size(size):
    views, surfaces, true_px = pair(camera=lens(*size))
    assert measure(views, surfaces).offset_x_px == pytest.approx(true_px, abs=ONE_PX)


def test_colour_pictures_are_as_good(town):
    views, surfaces, true_px = town
    views = tuple(np.repeat(view[..., None], 3, axis=2) for view in views)
    assert measure(views, surfaces).offset_x_px == pytest.approx(true_px, abs=ONE_PX)


def test_the_particles_that_the_rotation_matches_are_told(town):
    views, surfaces, true_px = town
    overlap = measure(views, surfaces)
    assert overlap.method == 'particles'
    n, m = overlap.left_match, overlap.right_match
    matched = overlap.left_particles[n], overlap.right_particles[m]
    shift = matched[0].center_x + surfaces[0].width / 2 - matched[1].center_x
    assert shift == pytest.approx(true_px, abs=radians(2.0) * surfaces[0].focal_px)
    assert overlap.min_correlation_value > 0


def test_pictures_of_different_size_and_centre(town):
    (left, right), (surface, _), true_px = town
    x, y = 30, 50
    cut = surface.window(x, y, surface.width - 60, surface.height - 120)
    right = right[y : y + cut.height, x : x + cut.width]
    overlap = measure((left, np.ascontiguousarray(right)), (surface, cut))
    assert overlap.offset_x_px == pytest.approx(true_px + x, abs=ONE_PX)
    assert overlap.offset_y_px == pytest.approx(y, abs=ONE_PX)


@pytest.mark.parametrize('turn', [Attitude(0, radians(1.5)), Attitude(0, 0, radians(-1.5))])
def test_a_tilted_right_camera_is_measured(town, turn):
    (left, right), surfaces, true_px = town
    overlap = measure((left, tilted(right, surfaces[1], turn)), surfaces)
    assert overlap.offset_x_px == pytest.approx(true_px, abs=2 * ONE_PX)
    found = overlap.attitude
    assert degrees(found.pitch_rad - turn.pitch_rad) == pytest.approx(0, abs=TILT_DEG)
    assert degrees(found.roll_rad - turn.roll_rad) == pytest.approx(0, abs=TILT_DEG)
    assert 'pitched' in overlap.message


def test_tilt_is_left_alone_on_request(town):
    (left, right), surfaces, _ = town
    right = tilted(right, surfaces[1], Attitude(0, 0, radians(1)))
    overlap = measure((left, right), surfaces, correct_tilt=False)
    assert overlap.found
    assert overlap.attitude.is_pure_yaw


def test_of_several_pairs_the_median_decides(town):
    views, surfaces, true_px = town
    camera = lens()
    astray = look(world(), surfaces[1], YAW_DEG / 2 + 10, camera)
    strange = look(world(5), surfaces[1], YAW_DEG / 2, camera)
    pairs = [(views[0], astray), views, views, (views[0], strange), views]
    overlap = measure_all(pairs, surfaces)
    assert overlap.offset_x_px == pytest.approx(true_px, abs=ONE_PX)


def test_most_pairs_without_a_common_scene_mean_none(town):
    views, surfaces, _ = town
    strange = look(world(5), surfaces[1], YAW_DEG / 2, lens())
    overlap = measure_all([views, (views[0], strange)], surfaces, 'correlation')
    assert not overlap.found


@pytest.fixture(scope='module')
def fence():
    """Return a pair of views of slats every 5 degrees: any of their offsets would do."""
    (left, right), surfaces, true_px = pair(scene=slats(5.0))
    return (exposed(left, 1.0, NOISE), exposed(right, 1.0, NOISE, seed=8)), surfaces, true_px


def test_a_scene_that_repeats_itself_is_told_and_not_believed(fence):
    views, surfaces, _ = fence
    overlap = measure(views, surfaces, 'correlation')
    assert not overlap.found
    assert 'repeats itself' in overlap.message
    assert 'expected_yaw_deg' in overlap.message
    assert not measure(views, surfaces).found


def test_the_expected_angle_decides(fence):
    views, surfaces, true_px = fence
    overlap = measure(
        views, surfaces, 'correlation', expected_yaw_deg=YAW_DEG + 1, yaw_tolerance_deg=2.5
    )
    assert overlap.found
    assert overlap.offset_x_px == pytest.approx(true_px, abs=ONE_PX)


@pytest.mark.parametrize('expected_deg', [YAW_DEG - 5, YAW_DEG, YAW_DEG + 5])
def test_what_mounts_say_bounds_the_search_by_correlation(fence, expected_deg):
    views, surfaces, _ = fence
    sides = (CameraView(surface, surface) for surface in surfaces)
    expected = Attitude(radians(expected_deg + 1))
    pair_input = PairInput(*sides, [views], expected, radians(2.5))
    overlap = METHODS['correlation'](pair_input, SETTINGS)
    assert overlap.found
    assert degrees(overlap.attitude.yaw_rad) == pytest.approx(expected_deg, abs=0.5)


def test_an_expected_angle_without_overlap_finds_none(fence):
    views, surfaces, _ = fence
    assert not measure(views, surfaces, expected_yaw_deg=260.0).found


def hard_pictures(left):
    """Pairs that no offset explains, made of the outline of a real view."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[: left.shape[0], : left.shape[1]]

    def noisy(values):
        return masked(left, values + rng.normal(0, 3, left.shape))

    chessboard = 60 + 140 * ((x // 24 + y // 24) % 2)
    return {
        'all black': (left * 0, left * 0),
        'covered': (noisy(np.full(left.shape, 4.0)), noisy(np.full(left.shape, 4.0))),
        'all white': (masked(left, left * 0 + 255.0),) * 2,
        'one black': (left, left * 0),
        'pure noise': tuple(masked(left, rng.integers(0, 256, left.shape)) for _ in range(2)),
        'one picture twice': (left, left.copy()),
        'one view twice': (left, noisy(left)),
        'chessboard': (noisy(chessboard), noisy(chessboard)),
        'horizontal gradient': (noisy(x * 0.3 + 20), noisy(x * 0.3 + 20)),
        'horizon': (noisy(60 + 120.0 * (y > 430)), noisy(60 + 120.0 * (y > 430))),
    }


@pytest.mark.parametrize('method', ['particles', 'correlation'])
@pytest.mark.parametrize('name', hard_pictures(np.ones((9, 9), np.uint8)))
def test_is_not_fooled_by(town, name, method):
    (left, _), surfaces, _ = town
    overlap = measure(hard_pictures(left)[name], surfaces, method)
    assert not overlap.found
    assert overlap.offset_x_px == surfaces[0].width
    assert overlap.overlap_px == 0
    assert overlap.confidence < SETTINGS.min_confidence
    assert overlap.message


def test_views_of_two_worlds_have_no_common_scene(town):
    (left, _), surfaces, _ = town
    strange = look(world(5), surfaces[1], YAW_DEG / 2, lens())
    assert not measure((left, strange), surfaces).found


def test_the_same_picture_twice_is_told(town):
    (left, _), surfaces, _ = town
    for method in ('particles', 'correlation'):
        assert 'same picture' in measure((left, left), surfaces, method).message


def test_what_a_corrected_image_does_not_show_stays_unseen_at_another_scale():
    surface = surface_for(lens())
    image = np.full((surface.height, surface.width), 90, np.uint8)
    image[:, :100], image[200:220, 300:320] = 0, 1
    corrected = CameraView(surface, surface.with_focal(surface.focal_px * 1.5)).corrected(image)
    assert not corrected[:, :148].any()
    assert corrected[:, 152:].all()


def refused(views, surfaces):
    return measure_corrected([views], *surfaces, SETTINGS, 'correlation')


class TestInput:
    """What cannot be measured is refused with a sentence."""

    def test_a_missing_picture(self, town):
        (left, _), surfaces, _ = town
        with pytest.raises(OverlapError, match='right picture is missing'):
            refused((left, None), surfaces)

    def test_no_pair(self, town):
        with pytest.raises(OverlapError, match='at least one'):
            measure_corrected([], *town[1], SETTINGS, 'correlation')

    def test_a_picture_of_another_size(self, town):
        (left, right), surfaces, _ = town
        with pytest.raises(OverlapError, match=r'right picture .* expected uint8 of 640x'):
            refused((left, right[:-5]), surfaces)

    def test_a_picture_of_another_type(self, town):
        (left, right), surfaces, _ = town
        with pytest.raises(OverlapError, match='left picture is float32'):
            refused((left.astype(np.float32), right), surfaces)

    def test_different_focal_lengths(self, town):
        views, (surface, other), _ = town
        with pytest.raises(OverlapError, match='focal lengths'):
            refused(views, (surface, replace(other, focal_px=surface.focal_px * 1.01)))

    def test_different_kinds(self, town):
        views, (surface, other), _ = town
        with pytest.raises(OverlapError, match='one kind'):
            refused(views, (surface, replace(other, kind='equirectangular')))

    def test_a_picture_that_holds_no_overlap(self, town):
        (surface, _) = town[1]
        tiny = np.zeros((surface.height, 31), np.uint8)
        with pytest.raises(OverlapError, match=r'31x.* is too small'):
            refused((tiny, tiny), (replace(surface, width=31),) * 2)


@pytest.mark.parametrize('method', METHODS)
def test_pictures_of_any_size_and_surface_have_an_answer(method):
    rng = np.random.default_rng(11)
    for _ in range(20):
        kind = SURFACES[rng.integers(len(SURFACES))]
        focal_px = float(np.exp(rng.uniform(0, 6)))
        surfaces = [
            Surface(kind, *map(int, rng.integers(32, 120, 2)), focal_px, *rng.uniform(-50, 150, 2))
            for _ in range(2)
        ]
        views = [rng.integers(0, 256, (s.height, s.width)).astype(np.uint8) for s in surfaces]
        overlap = measure(views, surfaces, method, min_confidence=float(rng.random()))
        assert 0 <= overlap.confidence <= 1
        assert np.isfinite([overlap.offset_x_px, overlap.overlap_px]).all()


@pytest.mark.parametrize('method', METHODS)
def test_plane_pictures_are_taken_too(method):
    surface = surface_for(lens(), 'rectilinear')
    views = tuple(look(world(), surface, yaw, lens()) for yaw in (-40, 40))
    overlap = measure(views, (surface, surface), method)
    assert overlap.attitude is None
    assert 'degrees' not in overlap.message


def test_the_paper_goes_by_its_own_rule(town):
    views, surfaces, _ = town
    overlap = measure(views, surfaces, 'paper')
    assert overlap.method == 'paper'
    assert overlap.found
    left = overlap.left_particles[overlap.left_match]
    right = overlap.right_particles[overlap.right_match]
    mean = (left.center_x + right.center_x) / 2
    assert overlap.offset_x_px == surfaces[0].width - surfaces[0].width // 2 + int(mean)
    assert overlap.offset_y_px == 0
    assert overlap.min_correlation_value > 0


def test_the_paper_without_particles_puts_the_views_side_by_side(town):
    (left, _), surfaces, _ = town
    overlap = measure((left, left * 0), surfaces, 'paper')
    assert not overlap.found
    assert overlap.offset_x_px == surfaces[0].width
    assert 'side by side' in overlap.message


def true_offset_px(name, surfaces):
    truth = json.loads((real_data('rigs', name) / 'truth.json').read_text())
    left, right = surfaces
    shift = left.center_x_px - right.center_x_px
    return left.focal_px * radians(truth['offset_deg']) + shift


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
@pytest.mark.parametrize('name', REAL)
def test_real_rigs(name, kind):
    views, surfaces = real_views(name, kind)
    overlap = measure(views, surfaces)
    assert overlap.found
    error_rad = (overlap.offset_x_px - true_offset_px(name, surfaces)) / surfaces[0].focal_px
    assert degrees(error_rad) == pytest.approx(0, abs=RIG_DEG)


@pytest.mark.parametrize('method', ['particles', 'correlation'])
@pytest.mark.parametrize('name', ['apart_lobby', 'apart_mixed'])
def test_real_views_that_share_nothing(name, method):
    assert not measure(*real_views(name), method).found


def test_two_real_lenses_agree_with_themselves():
    offsets = []
    for name in SHUN:
        views, surfaces = real_views(name)
        overlap = measure(views, surfaces)
        assert overlap.found
        offsets.append(degrees(overlap.offset_x_px / surfaces[0].focal_px))
    assert offsets == pytest.approx([np.median(offsets)] * len(SHUN), abs=SHUN_DEG)
