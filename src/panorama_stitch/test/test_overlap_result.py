"""What an offset means as an angle."""

from dataclasses import replace
from math import isnan, radians

import numpy as np
import pytest

from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.lens_surface import surface_for
from panorama_stitch.overlap.overlap_result import yaw_between_rad

SURFACE = surface_for(synthetic_lens(640, 480, np.radians(170)))


def test_the_angle_is_that_between_the_axes_wherever_the_axes_meet_the_pictures():
    left = replace(SURFACE, center_x_px=SURFACE.center_x_px + 12)
    right = replace(SURFACE, center_x_px=SURFACE.center_x_px - 8)
    offset_x_px = radians(140) * SURFACE.focal_px + left.center_x_px - right.center_x_px
    assert yaw_between_rad(offset_x_px, left, right) == pytest.approx(radians(140))


def test_on_a_plane_an_offset_is_no_angle():
    flat = replace(SURFACE, kind='rectilinear')
    assert isnan(yaw_between_rad(100.0, flat, flat))
