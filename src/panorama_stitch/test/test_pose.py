from math import radians

import numpy as np
import pytest
from scenes import lens

from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import RemapTable
from panorama_stitch.overlap.pose import Pose


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
def test_a_point_lies_where_the_turned_picture_shows_it(kind):
    surface = surface_for(lens(), kind)
    turn = Pose(0.0, 0.0, radians(2), radians(-1.5)).turn
    picture = np.zeros((surface.height, surface.width), np.uint8)
    shares = np.array([[0.3, 0.35], [0.5, 0.6], [0.75, 0.5]])
    points = np.rint(shares * (surface.width, surface.height)).astype(int)
    for x, y in points:
        picture[y - 2 : y + 3, x - 2 : x + 3] = 255
    turned = RemapTable(surface, surface, attitude=turn)(picture)
    places = Pose(7.0, -3.0, turn.pitch_rad, turn.roll_rad).place(surface, points) - (7.0, -3.0)
    for x, y in np.rint(places).astype(int):
        spot = turned[y - 6 : y + 7, x - 6 : x + 7].astype(float)
        center = np.array([np.average(np.arange(-6, 7), weights=spot.sum(axis=a)) for a in (0, 1)])
        assert center == pytest.approx(0, abs=0.6)  # `places` were rounded


def test_a_level_pose_only_shifts():
    surface = surface_for(lens())
    assert Pose(5.0, 2.0).place(surface, np.array([[1.0, 1.0]])).tolist() == [[6.0, 3.0]]


def test_jacobian_tells_where_a_small_step_leads():
    surface = surface_for(lens())
    points = np.array([[100.0, 200.0], [300.0, 600.0]])
    start, step = Pose(10.0, 1.0, 0.01, -0.02), np.array([0.5, -0.2, 1e-4, 2e-4])
    expected = start.place(surface, points) + start.jacobian(surface, points) @ step
    assert start.moved(step).place(surface, points) == pytest.approx(expected, abs=1e-3)


def test_scaled_keeps_the_turn():
    assert Pose(10.0, 4.0, 0.1, 0.2).scaled(0.5) == Pose(5.0, 2.0, 0.1, 0.2)
