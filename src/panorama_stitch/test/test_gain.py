"""Gain compensation: right, robust, slow enough, and out of the way where it is not needed."""

import numpy as np
import pytest
from known_rigs import rig_of
from scenes import placed_at

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens_surface import surface_for
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.gain import GainCompensation
from panorama_stitch.compose.layout import lay_out
from panorama_stitch.compose.view import View
from panorama_stitch.pipeline.panorama import Panorama

YAW = np.radians(140)
LENS = synthetic_lens(320, 240, np.radians(170))
SURFACE = surface_for(LENS)
VIEWS = [View(LENS, SURFACE)] * 2
PLACED = placed_at(VIEWS, (YAW * SURFACE.focal_px, 0))
LAYOUT = lay_out(PLACED, fade_px=8.0, crop='valid')
RIGHT = 0.01
"""A relative error of a factor that costs a grey level in what is bright."""
UNSEEN_LEVELS = 0.5
"""A change from one panorama to the next that nobody sees."""


def pictures(left=1.0, right=1.0):
    """Photograph with different exposures, one number or one for each channel."""
    return [
        np.minimum(
            Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0) * np.asarray(gain), 255
        ).astype(np.uint8)
        for yaw, gain in ((-YAW / 2, left), (YAW / 2, right))
    ]


@pytest.mark.parametrize(('left', 'right'), [(1.0, 1.3), (1.2, 0.8)])
def test_the_brighter_camera_is_darkened(left, right):
    factors = GainCompensation(LAYOUT, PLACED, pictures(left, right)).factors
    assert factors[0] / factors[1] == pytest.approx(np.full(3, right / left), rel=RIGHT)
    assert factors.max() == 1.0


def test_where_the_sky_is_clipped_white_stays_white():
    factors = GainCompensation(LAYOUT, PLACED, pictures(1.0, 1.8)).factors
    assert factors[0] == pytest.approx(np.full(3, 1.8), rel=RIGHT)
    assert (factors[1] == 1.0).all()


def test_a_sky_that_comes_later_becomes_white_and_what_follows_it_dark_again_without_a_jump():
    dim = pictures(0.35, 0.7)
    under_the_sky = [image.copy() for image in dim]
    for image in under_the_sky:
        image[: len(image) // 2] = 255
    gain, levels = GainCompensation(LAYOUT, PLACED, dim), []
    for images, reference, other in ((dim, 0, 0.5), (under_the_sky, 1, 2.0), (dim, 0, 0.5)):
        for _ in range(240):
            gain.update(images)
            levels.append(np.log(gain.factors[:, 0]))
        assert gain.factors[reference] == pytest.approx(np.ones(3), rel=RIGHT)
        assert gain.factors[1 - reference] == pytest.approx(np.full(3, other), rel=2 * RIGHT)
    assert np.abs(np.diff(levels, axis=0)).max() < np.log(2.0) / 5


def test_a_little_white_changes_nothing_that_was_chosen_before():
    dim = pictures(0.35, 0.7)
    gain = GainCompensation(LAYOUT, PLACED, dim)
    for rows, reference in ((4, 0), (120, 1), (4, 1)):
        images = [image.copy() for image in dim]
        for image in images:
            image[60 : 60 + rows] = 255
        for _ in range(240):
            gain.update(images)
        assert gain.factors[reference] == pytest.approx(np.ones(3), rel=RIGHT)


def test_a_tint_is_taken_out():
    tint = np.array([0.9, 1.0, 1.08])
    gain = GainCompensation(LAYOUT, PLACED, pictures(right=tint))
    ratio = gain.factors[0] / gain.factors[1]
    assert ratio == pytest.approx(tint, rel=RIGHT)
    drawn = np.full((100, LAYOUT.drawn(1)[1] - LAYOUT.drawn(1)[0], 3), 100, np.uint8)
    gain.apply(1, drawn)
    assert drawn[0, 0] == pytest.approx(100 * gain.factors[1], abs=1)
    assert (drawn == drawn[0, 0]).all()


def test_what_one_camera_shows_alone_does_not_count():
    images = pictures(1.0, 1.3)
    images[0][60:160, 240:] = 250
    factors = GainCompensation(LAYOUT, PLACED, images).factors
    assert factors[0] / factors[1] == pytest.approx(np.full(3, 1.3), rel=RIGHT)


def test_equal_cameras_are_left_alone():
    gain = GainCompensation(LAYOUT, PLACED, pictures())
    drawn = np.arange(60, dtype=np.uint8).reshape(4, 5, 3)
    gain.apply(0, drawn)
    assert (drawn.ravel() == np.arange(60)).all()


def test_it_follows_a_change_of_exposure_without_a_jump():
    gain = GainCompensation(LAYOUT, PLACED, pictures())
    images = pictures(1.0, 1.3)
    relations = []
    for _ in range(240):
        gain.update(images)
        relations.append(np.log(gain.factors[0, 0] / gain.factors[1, 0]))
    steps = np.diff(relations)
    assert relations[-1] == pytest.approx(np.log(1.3), abs=RIGHT)
    assert (steps >= 0).all()
    assert steps.max() < np.log(1.3) / 3


def test_noise_and_a_passer_by_do_not_flicker():
    noise = np.random.default_rng(3)
    clean = pictures(1.0, 1.3)
    gain = GainCompensation(LAYOUT, PLACED, clean)
    compositor = Compositor(LAYOUT, PLACED, gain=gain)
    out = np.empty((LAYOUT.surface.height, LAYOUT.surface.width, 3), np.uint8)
    seam, brightness = slice(*LAYOUT.seams[0]), []
    for i in range(64):
        noisy = [c + noise.normal(0, 4, c.shape) for c in clean]
        noisy[1][:, 3 * i - 30 : 3 * i] = 20
        gain.update([image.clip(0, 255).astype(np.uint8) for image in noisy])
        compositor.compose(clean, out)
        brightness.append(out[:, seam].mean())
    assert np.ptp(brightness) < UNSEEN_LEVELS


def test_grey_pictures():
    images = [image[..., 1] for image in pictures(1.0, 1.3)]
    gain = GainCompensation(LAYOUT, PLACED, images)
    assert gain.factors == pytest.approx(np.array([[1.0], [1 / 1.3]]), rel=RIGHT)
    drawn = np.full((10, 20), 130, np.uint8)
    gain.apply(1, drawn)
    assert (drawn == 100).all()


def test_a_chain_of_cameras_is_evened_out_to_one():
    offsets = [(np.radians(120) * SURFACE.focal_px, 0)] * 2
    views = [View(LENS, SURFACE)] * 3
    placed = placed_at(views, *offsets)
    layout = lay_out(placed, fade_px=8.0, crop='valid')
    images = [
        (Scene().view(LENS, Attitude(yaw_rad=np.radians(yaw))).frame(0) * exposure).astype(
            np.uint8
        )
        for yaw, exposure in ((-120, 1.1), (0, 0.9), (120, 1.2))
    ]
    factors = GainCompensation(layout, placed, images).factors[:, 0]
    assert factors == pytest.approx([0.9 / 1.1, 1.0, 0.9 / 1.2], rel=RIGHT)


def test_a_camera_that_shows_nothing_is_left_out():
    offsets = [(np.radians(120) * SURFACE.focal_px, 0)] * 2
    views = [View(LENS, SURFACE)] * 3
    placed = placed_at(views, *offsets)
    layout = lay_out(placed, fade_px=8.0, crop='valid')
    left, middle = (
        (Scene().view(LENS, Attitude(yaw_rad=np.radians(yaw))).frame(0) * exposure).astype(
            np.uint8
        )
        for yaw, exposure in ((-120, 1.1), (0, 0.9))
    )
    factors = GainCompensation(layout, placed, [left, middle, np.zeros_like(left)]).factors[:, 0]
    assert factors == pytest.approx([0.9 / 1.1, 1.0, 1.0], rel=RIGHT)


@pytest.mark.parametrize('is_drawn', [True, False])
def test_beside_a_silent_camera_the_living_ones_are_still_evened_out(is_drawn):
    compositor, images = rig_of([Attitude(yaw_rad=np.radians(yaw)) for yaw in (-120, 0, 120)])
    surface = compositor.layout.surface
    out = np.empty((surface.height, surface.width, 3), np.uint8)
    now = [images[0], images[1] // 2, images[2] // 3]
    panorama = Panorama(
        compositor, now, 0, 'bgr8', {'right': ((0, 0), 9.0)}, stale_cameras=frozenset({2})
    )
    for _ in range(160):
        if is_drawn:
            panorama.draw(out)
        else:
            panorama.expose()
    left, middle, right = compositor.gain.factors.mean(axis=1)
    assert left / middle == pytest.approx(0.5, rel=2 * RIGHT)
    assert right / middle == pytest.approx(1.0, rel=RIGHT), 'as it was when it fell silent'


def test_without_a_common_scene_nothing_is_changed():
    placed = placed_at(VIEWS, (SURFACE.width, 0), found=False)
    layout = lay_out(placed, fade_px=8.0, crop='none')
    assert (GainCompensation(layout, placed, pictures(1.0, 1.3)).factors == 1.0).all()
