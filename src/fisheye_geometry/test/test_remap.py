"""Remap tables: right, read-only, cached, and drawn straight into slices."""

import numpy as np
import pytest

from fisheye_core.errors import GeometryError, ImageFormatError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import make_lens
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import INTERPOLATIONS, RemapTable, remap_table
from fisheye_geometry.surface import Surface

LENS = make_lens(
    'equidistant', 320, 240, [111.5, 0, 159.5, 0, 111.5, 119.5, 0, 0, 1], [-0.02, 0.004, 0, 0]
)
SURFACE = surface_for(LENS)
FIXED_POINT_LEVELS = 2.0
"""Maps hold 1/32 px, which on this ramp is less than a grey level."""


def ramps(lens):
    """Make a picture whose value tells the column, and one that tells the row."""
    x, y = np.meshgrid(np.arange(lens.width), np.arange(lens.height))
    return (x * 0.75).astype(np.uint8), y.astype(np.uint8)


@pytest.mark.parametrize('interpolation', INTERPOLATIONS)
def test_each_pixel_comes_from_where_its_ray_meets_the_picture(interpolation):
    table = RemapTable(LENS, SURFACE, interpolation)
    y, x = np.mgrid[0 : SURFACE.height, 0 : SURFACE.width]
    source, _ = LENS.project(SURFACE.rays(x, y))
    inside = table.valid & np.all((source > 2) & (source < (317, 237)), axis=-1)
    columns, rows = (table(ramp) for ramp in ramps(LENS))
    assert np.abs(columns - source[..., 0] * 0.75)[inside].max() < FIXED_POINT_LEVELS
    assert np.abs(rows - source[..., 1])[inside].max() < FIXED_POINT_LEVELS


@pytest.mark.parametrize('interpolation', INTERPOLATIONS)
def test_exactly_the_valid_pixels_are_drawn(interpolation):
    table = RemapTable(LENS, SURFACE, interpolation)
    white = table(np.full((240, 320, 3), 255, np.uint8))
    assert 0.5 < table.valid.mean() < 1
    assert (white[table.valid] == 255).all()
    assert (white[~table.valid] == 0).all()


def test_a_slice_is_drawn_in_place():
    table = RemapTable(LENS, SURFACE)
    image = np.random.default_rng(1).integers(0, 255, (240, 320, 3), np.uint8)
    whole = np.full((SURFACE.height, SURFACE.width + 40, 3), 7, np.uint8)
    table(image, whole[:, 20:-20])
    assert (whole[:, 20:-20] == table(image)).all()
    assert (whole[:, :20] == 7).all()
    assert (whole[:, -20:] == 7).all()


def test_tables_are_cached_and_read_only():
    assert remap_table(LENS, SURFACE) is remap_table(LENS, SURFACE)
    assert remap_table(LENS, SURFACE) is not remap_table(LENS, SURFACE, 'nearest')
    assert remap_table.cache_info().maxsize <= 4, 'a table of a large panorama takes 30 MB'
    with pytest.raises(ValueError, match='read-only'):
        remap_table(LENS, SURFACE).valid[0, 0] = True


def test_a_turn_looks_where_it_says():
    turn = Attitude(yaw_rad=0.2, pitch_rad=0.1, roll_rad=0.3)
    right, down, forward = turn.matrix.T
    assert np.arctan2(forward[0], forward[2]) == pytest.approx(0.2), 'yaw is to the right'
    assert -np.arcsin(forward[1]) == pytest.approx(0.1), 'pitch is up'
    assert right[1] > 0, 'roll is clockwise'
    assert np.linalg.det(turn.matrix) == pytest.approx(1)
    assert np.cross(right, down) == pytest.approx(forward)


def test_a_corrected_picture_can_be_cut_from_a_surface():
    image = np.random.default_rng(1).integers(1, 255, (SURFACE.height, SURFACE.width), np.uint8)
    window = SURFACE.window(30, 20, 50, 40)
    assert (RemapTable(SURFACE, window)(image) == image[20:60, 30:80]).all()


def test_what_does_not_fit_is_refused():
    table = RemapTable(LENS, SURFACE)
    with pytest.raises(ImageFormatError, match='has 100x240 px; its calibration is for 320x240'):
        table(np.zeros((240, 100, 3), np.uint8))
    with pytest.raises(ImageFormatError, match=r'out is .*expected'):
        table(np.zeros((240, 320, 3), np.uint8), np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(GeometryError, match="'lanczos' is not known; expected one of nearest"):
        RemapTable(LENS, SURFACE, 'lanczos')


def test_a_surface_behind_the_lens_is_empty():
    behind = Surface('equirectangular', 50, 50, 100.0, 25 - 100 * np.pi, 25)
    assert not RemapTable(LENS, behind).valid.any()
