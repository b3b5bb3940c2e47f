"""What an offset means as an angle."""

from dataclasses import replace
from math import isnan, radians

import numpy as np
import pytest

from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.surface import SURFACES
from panorama_stitch.overlap.overlap_by_hand import overlap_by_hand
from panorama_stitch.overlap.overlap_result import (
    Overlap,
    attitude_at,
    common_px,
    with_offset,
    yaw_between_rad,
)

SURFACE = surface_for(synthetic_lens(640, 480, np.radians(170)))


def test_the_angle_is_that_between_the_axes_wherever_the_axes_meet_the_pictures():
    left = replace(SURFACE, center_x_px=SURFACE.center_x_px + 12)
    right = replace(SURFACE, center_x_px=SURFACE.center_x_px - 8)
    offset_x_px = radians(140) * SURFACE.focal_px + left.center_x_px - right.center_x_px
    assert yaw_between_rad(offset_x_px, left, right) == pytest.approx(radians(140))


def test_on_a_plane_an_offset_is_no_angle():
    flat = replace(SURFACE, kind='rectilinear')
    assert isnan(yaw_between_rad(100.0, flat, flat))


TILT = radians(10)
TILT_ROW = {'cylindrical': np.tan(TILT), 'equirectangular': TILT, 'rectilinear': np.tan(TILT)}
"""Rows of each surface, in focal lengths, from the axis to the horizon of a camera that looks up
by so much."""


@pytest.mark.parametrize('kind', SURFACES)
def test_a_vertical_offset_is_one_of_rows_of_the_surface(kind):
    surface = replace(SURFACE, kind=kind)
    right = Attitude(radians(120), TILT)
    overlap = with_offset(
        Overlap('particles', True, attitude=right), surface, surface, (LEVEL, right)
    )
    assert overlap.offset_y_px == pytest.approx(-TILT_ROW[kind] * surface.focal_px)
    back = attitude_at(overlap.offset_x_px, overlap.offset_y_px, surface, surface, LEVEL)
    if surface.yaw_is_column_shift:
        assert vars(back) == pytest.approx(vars(right))
    else:
        assert back is None


@pytest.mark.parametrize(
    ('offset_x_px', 'left', 'right', 'expected'),
    [
        (300, 400, 400, 100),
        (300, 400, 50, 50),
        (-90, 400, 1000, 400),
        (-90, 400, 200, 110),
        (400, 400, 400, 0),
        (-400, 400, 400, 0),
    ],
)
def test_common_columns_are_those_that_both_images_fill(offset_x_px, left, right, expected):
    surfaces = (replace(SURFACE, width=width) for width in (left, right))
    assert common_px(offset_x_px, *surfaces) == expected


def test_images_of_different_height_stay_level_when_one_is_moved_by_hand():
    lower = replace(SURFACE, height=SURFACE.height - 100, center_y_px=SURFACE.center_y_px - 100)
    aside = Overlap('', False, float(SURFACE.width), 0.0)
    overlap = overlap_by_hand(aside, 500.0, np.nan, SURFACE, lower, (LEVEL, LEVEL))
    assert overlap.found
    assert overlap.attitude.is_pure_yaw
    assert overlap.offset_y_px == 100
