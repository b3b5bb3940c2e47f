import numpy as np
import pytest
from scenes import exposed, lens, masked, pair, world

from panorama_stitch.overlap.structure import face, structure

STRONG = 1.0
"""Standard deviation of the structure of a scene full of things, about."""
FAINT = 0.1
"""What smoothing from one side alone leaves at the rim, about."""


@pytest.fixture(scope='module')
def picture():
    return pair()[0][0]


def columns(picture):
    return np.tile(np.linspace(-1, 1, picture.shape[1]), (picture.shape[0], 1))


def test_a_scene_has_structure(picture):
    found = structure(picture, 2)
    assert found.image[found.valid > 0].std() == pytest.approx(STRONG, rel=0.3)


def test_exposure_does_not_matter(picture):
    dark = structure(exposed(picture, 0.5, 0), 2)
    bright = structure(exposed(picture, 0.9, 0), 2)
    assert np.corrcoef(dark.image.ravel(), bright.image.ravel())[0, 1] > 0.99


@pytest.mark.parametrize('shape', ['gradient', 'vignetting', 'horizon', 'sky'])
def test_smooth_areas_and_horizons_are_none(picture, shape):
    across = columns(picture)
    down = np.arange(picture.shape[0])[:, None] / picture.shape[0]
    values = {
        'gradient': 128 + 100 * across,
        'vignetting': 200 * (1 - 0.5 * across**2),
        'horizon': np.where(down > 0.5, 60, 190) + 0 * across,
        'sky': 220 - 80 * down + 0 * across,
    }[shape]
    assert structure(masked(picture, values), 2).image.std() < FAINT


def test_noise_counts_for_little(picture):
    noise = np.random.default_rng(0).normal(128, 3, picture.shape)
    assert structure(masked(picture, noise), 2).image.std() < 0.3 * STRONG


def test_what_the_lens_does_not_see_is_left_out(picture):
    found = structure(picture, 1)
    assert not found.valid[picture == 0].any()
    assert not found.image[found.valid == 0].any()


def test_facing_knows_its_scale():
    views, surfaces, _ = pair(scene=world(), camera=lens(1280, 960))
    facing = face(*views, surfaces[1], 6.0, px_per_deg=2.0)
    assert facing.step == 4
    assert facing.level_y_px == 1.5
    assert facing.px_per_deg == pytest.approx(surfaces[1].focal_px * np.pi / 180 / 4)
    x, y = 37, 61
    rays = facing.surface.rays(x, y)
    middle = (facing.step - 1) / 2
    assert rays == pytest.approx(surfaces[1].rays(4 * x + middle, 4 * y + middle))
