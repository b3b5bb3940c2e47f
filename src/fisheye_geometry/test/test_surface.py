"""Surfaces: pixels to rays and back, and the sizes that follow from a lens."""

import numpy as np
import pytest

from fisheye_core.errors import GeometryError
from fisheye_geometry.lens import make_lens
from fisheye_geometry.surface import SURFACES, Surface, surface_for

LENS = make_lens(
    'equidistant',
    640,
    480,
    [223.052760542, 0, 319.5, 0, 223.052760542, 239.5, 0, 0, 1],
    [-0.02, 0.004, -0.001, 0.0001],
)


@pytest.mark.parametrize('kind', SURFACES)
def test_a_pixel_comes_back_from_its_ray(kind):
    surface = Surface(kind, 640, 400, 200.0, 310.0, 190.0)
    x, y = np.meshgrid(np.arange(640.0), np.arange(400.0))
    pixels, seen = surface.project(surface.rays(x, y) * 3)
    assert seen.all()
    assert np.abs(pixels - np.stack([x, y], -1)).max() < 1e-9


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
def test_a_turn_of_the_camera_is_a_shift_of_columns(kind):
    surface = Surface(kind, 900, 400, 200.0, 450.0, 190.0)
    turn = 0.7
    rays = surface.rays(np.arange(100.0, 600.0), 120.0)
    turned = rays @ np.array(
        [[np.cos(turn), 0, -np.sin(turn)], [0, 1, 0], [np.sin(turn), 0, np.cos(turn)]]
    )
    shift = surface.project(turned)[0] - surface.project(rays)[0]
    assert shift == pytest.approx(np.broadcast_to([turn * 200, 0], shift.shape), abs=1e-9)
    assert surface.yaw_is_column_shift


def test_a_ray_behind_a_plane_is_not_seen():
    surface = Surface('rectilinear', 100, 100, 50.0, 50.0, 50.0)
    _, seen = surface.project(np.array([[0.1, 0, 1], [0.1, 0, -1], [1, 0, 0]]))
    assert seen.tolist() == [True, False, False]
    assert not surface.yaw_is_column_shift


def test_preserve_area_keeps_the_lens_scale_and_its_field_of_view():
    surface = surface_for(LENS)
    assert surface.focal_px == LENS.focal_x_px
    assert surface.width == round(np.radians(170) * LENS.focal_x_px)
    assert surface.rays(surface.center_x_px, surface.center_y_px) == pytest.approx([0, 0, 1])


def test_fit_keeps_the_size_of_the_picture():
    surface = surface_for(LENS, scale='fit')
    assert (surface.width, surface.height) == (640, 480)
    assert surface.focal_px == pytest.approx(640 / np.radians(170))


def test_asked_field_of_view_and_width():
    surface = surface_for(LENS, hfov_rad=2.0, vfov_rad=1.0, width=1000)
    assert surface.focal_px == pytest.approx(500)
    assert surface.height == round(2 * 500 * np.tan(0.5))


@pytest.mark.parametrize('kind', SURFACES)
def test_a_full_circle_lens_does_not_blow_a_surface_up(kind):
    wide = make_lens('equidistant', 900, 900, [260, 0, 449.5, 0, 260, 449.5, 0, 0, 1], [0] * 4)
    surface = surface_for(wide, kind)
    assert surface.height < 6 * surface.focal_px


def test_window_and_focal_keep_directions():
    surface = Surface('cylindrical', 640, 400, 200.0, 310.0, 190.0)
    part = surface.window(100, 50, 30, 20)
    assert part.rays(3, 4) == pytest.approx(surface.rays(103, 54))
    double = surface.with_focal(400.0)
    assert (double.width, double.height) == (1280, 800)
    assert double.rays(2 * 103 + 0.5, 2 * 54 + 0.5) == pytest.approx(surface.rays(103, 54))


@pytest.mark.parametrize(
    ('options', 'words'),
    [
        ({'kind': 'spherical'}, "'spherical' is not known; expected one of cylindrical"),
        ({'scale': 'huge'}, "'huge' is not known; expected one of preserve_area, fit"),
        ({'kind': 'rectilinear', 'hfov_rad': 3.0}, 'holds less than 170 degrees; 171.887'),
        ({'vfov_rad': 3.1415}, 'px is not possible'),
    ],
)
def test_impossible_surfaces_are_refused(options, words):
    with pytest.raises(GeometryError, match=words):
        surface_for(LENS, **options)
