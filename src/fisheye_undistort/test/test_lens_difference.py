from dataclasses import replace

import numpy as np
import pytest
from conftest import fisheye

from fisheye_core.errors import SettingError
from fisheye_undistort.report.difference_plot import plot_difference
from fisheye_undistort.report.lens_difference import LensDifference

LENS = fisheye(170)


def test_a_lens_does_not_differ_from_itself():
    difference = LensDifference(LENS, LENS)
    assert np.nanmax(difference.apart_deg) < 1e-5
    assert difference.turned_deg < 1e-5


def test_a_moved_principal_point_is_mostly_a_rotation():
    moved = replace(LENS, center_x_px=LENS.center_x_px + 3)
    difference = LensDifference(LENS, moved)
    expected = np.degrees(3 / LENS.focal_x_px)
    assert abs(difference.turned_deg / expected - 1) < 0.1
    assert np.nanmedian(difference.apart_deg) < expected / 4


def test_another_focal_length_shows_where_it_matters():
    longer = replace(LENS, focal_x_px=LENS.focal_x_px * 1.01, focal_y_px=LENS.focal_y_px * 1.01)
    difference = LensDifference(LENS, longer)
    assert difference.turned_deg < 0.05
    at = difference.angle_deg
    apart = difference.apart_deg
    assert np.nanmean(apart[at < 20]) < np.nanmean(apart[(at > 60) & (at < 80)]) / 2
    assert '70-80 deg' in str(difference)


def test_lenses_of_other_sizes_are_refused():
    with pytest.raises(SettingError, match='for 640x480 and 1280x960 px; expected one size'):
        LensDifference(LENS, fisheye(170, 2))


def test_the_map_is_drawn(tmp_path):
    moved = replace(LENS, focal_x_px=LENS.focal_x_px * 1.01)
    plot_difference(tmp_path / 'difference.png', LensDifference(LENS, moved))
    assert (tmp_path / 'difference.png').stat().st_size > 10_000
