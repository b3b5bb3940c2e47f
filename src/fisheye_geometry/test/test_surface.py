"""Surfaces: pixels to rays and back, and the sizes that follow from a lens."""

import numpy as np
import pytest

from fisheye_core.errors import GeometryError
from fisheye_geometry.lens import make_lens
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.surface import SURFACES, Surface
from fisheye_geometry.surface_kind import KINDS, SurfaceKind

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


@pytest.mark.parametrize('kind', SURFACES)
@pytest.mark.parametrize('angle_rad', [-0.7, 0.0, 0.4])
def test_a_row_has_the_angle_of_its_ray(kind, angle_rad):
    surface = Surface(kind, 640, 400, 200.0, 310.0, 190.0)
    ray = np.array([0.0, np.sin(angle_rad), np.cos(angle_rad)])
    y_px = surface.row_px(angle_rad)
    assert y_px == pytest.approx(surface.project(ray)[0][1])
    assert surface.depression_rad(y_px) == pytest.approx(angle_rad)


def check_kind(how: SurfaceKind):
    """Demand of a kind of surface what the rest of the code takes for granted."""
    a, b = np.meshgrid(np.linspace(-0.9, 0.9, 7), np.linspace(-0.8, 0.8, 5))
    x, y, z = how.rays(a, b)
    assert np.array(how.point(3 * x, 3 * y, 3 * z)) == pytest.approx(np.array([a, b]), abs=1e-9)
    ahead = np.array(how.rays(np.zeros(1), np.zeros(1))).ravel()
    assert ahead / np.linalg.norm(ahead) == pytest.approx([0, 0, 1])
    for angle in (0.0, 0.3, 0.9):
        side = np.array([np.sin(angle)]), np.zeros(1), np.array([np.cos(angle)])
        assert how.point(*side) == pytest.approx((how.column(angle), 0), abs=1e-9)
        down = np.zeros(1), np.array([np.sin(angle)]), np.array([np.cos(angle)])
        assert how.point(*down) == pytest.approx((0, how.row(angle)), abs=1e-9)
    turn = 0.4
    turned = how.point(x * np.cos(turn) + z * np.sin(turn), y, z * np.cos(turn) - x * np.sin(turn))
    is_shift = np.allclose(np.array(turned), np.array([a + turn, b]), atol=1e-9)
    assert is_shift == how.yaw_is_column_shift
    assert 0 < how.steepest_rad <= np.pi / 2
    assert 0 < how.widest_rad <= np.pi
    assert how.fov_limit_rad > 2 * how.steepest_rad


@pytest.mark.parametrize('kind', KINDS)
def test_each_kind_of_surface_is_what_it_says(kind):
    check_kind(KINDS[kind])


class Stereographic(SurfaceKind):
    """A plane seen from the point opposite, with what its author took over from the cylinder."""

    yaw_is_column_shift = True
    steepest_rad = widest_rad = np.pi / 2

    def rays(self, a, b):
        return 4 * a, 4 * b, 4 - a * a - b * b

    def point(self, x, y, z):
        length = np.sqrt(x * x + y * y + z * z)
        return 2 * x / (length + z), 2 * y / (length + z)

    def column(self, angle_rad):
        return 2 * np.tan(angle_rad / 2)

    row = column


def test_a_new_kind_that_says_of_itself_what_is_not_true_fails():
    with pytest.raises(AssertionError):
        check_kind(Stereographic())
    Stereographic.yaw_is_column_shift = False
    check_kind(Stereographic())


def test_a_kind_without_its_properties_is_refused_where_it_is_written():
    with pytest.raises(
        TypeError, match='Half lacks yaw_is_column_shift, steepest_rad, widest_rad'
    ):
        type('Half', (SurfaceKind,), {})


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
