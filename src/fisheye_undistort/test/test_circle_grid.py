import cv2
import numpy as np
import pytest
from conftest import fisheye
from rendered_view import Look, facing_pose, render_view

from fisheye_core.errors import ImageFormatError, SettingError
from fisheye_undistort.detect.circle_grid import area_bands, find_circles
from fisheye_undistort.detect.grid_order import order_grid
from fisheye_undistort.target.target import STANDARD

CENTER_PX = 0.02
"""A hundredth of the edge's width: what 2 grey levels of noise leave."""
SHADOW_PX = 1.0
"""Where a shadow's edge crosses a circle, only the binary centre of mass is left."""


def disc(center, radius, size=(120, 100), light=1.0):
    """Draw a dark ellipse of (radius x, radius y) with exact coverage of the edge pixels."""
    fine = 8
    y, x = (np.arange(side * fine) / fine + 0.5 / fine - 0.5 for side in size[::-1])
    inside = ((x - center[0]) / radius[0]) ** 2 + ((y[:, None] - center[1]) / radius[1]) ** 2 < 1
    ink = cv2.resize(inside.astype(np.float32), size, interpolation=cv2.INTER_AREA)
    picture = (220 - 190 * ink) * light
    noise = np.random.default_rng(1).normal(0, 2, picture.shape)
    return (picture + noise).round().clip(0, 255).astype(np.uint8)


@pytest.mark.parametrize('radius', [(8, 8), (20, 20), (20, 9), (7, 16)])
@pytest.mark.parametrize('center', [(60.0, 50.0), (57.3, 48.8)])
def test_the_centre_of_mass_is_exact(center, radius):
    circles = find_circles(disc(center, radius), 60, 5000)
    assert len(circles) == 1
    assert np.abs(circles.centers[0] - center).max() < CENTER_PX
    axes = 2 * np.sqrt(np.diag(circles.shapes[0]))
    assert np.allclose(axes, radius, atol=0.15)


def test_light_that_falls_off_moves_nothing():
    light = np.linspace(1.0, 0.3, 120)
    circles = find_circles(disc((60.2, 49.7), (20, 20), light=light), 60, 5000)
    assert np.abs(circles.centers[0] - (60.2, 49.7)).max() < CENTER_PX


def test_the_edge_of_a_shadow_is_survived():
    pose = facing_pose(0.3, 0.4, 260, (0.3, 0.2, 0.1))
    picture = render_view(fisheye(170), STANDARD['circles'], pose, Look(noise=0))
    shaded = picture.copy()
    shaded[:, :400] = (picture[:, :400] * 0.45).astype(np.uint8)
    (whole, ids), (cast, shaded_ids) = (
        order_grid(find_circles(image), STANDARD['circles']) for image in (picture, shaded)
    )
    # Half a turn of the sheet looks the same.
    order = min((shaded_ids, 8 - shaded_ids), key=lambda o: np.abs(cast[o] - whole[ids]).sum())
    assert np.linalg.norm(cast[order] - whole[ids], axis=-1).max() < SHADOW_PX


def test_what_is_not_round_or_is_cut_off_is_left_out():
    picture = np.full((200, 300), 220, np.uint8)
    cv2.rectangle(picture, (20, 20), (110, 40), 20, -1)
    cv2.line(picture, (150, 30), (280, 60), 20, 3)
    cv2.circle(picture, (0, 100), 25, 20, -1)
    cv2.circle(picture, (150, 130), 25, 20, -1)
    circles = find_circles(picture)
    assert np.allclose(circles.centers, [[150, 130]], atol=0.1)


def test_particles_are_filtered_by_area():
    picture = disc((60, 50), (15, 15))
    area = np.pi * 15**2
    assert len(find_circles(picture, area - 50, area + 50)) == 1
    assert len(find_circles(picture, area + 50, area + 1000)) == 0
    assert len(find_circles(picture, area - 1000 / 2, area - 50)) == 0


def test_limits_follow_the_size_of_the_picture():
    assert area_bands((480, 640))[0] == (100, 10_000)
    assert area_bands((960, 1280))[0] == (400, 40_000)
    assert area_bands((960, 1280), 50, 0)[0] == (50, 40_000)
    assert area_bands((960, 1280), 50, 500) == [(50, 500)]


def test_smaller_and_larger_circles_are_tried_too():
    bands = area_bands((480, 640))
    assert min(low for low, _ in bands) < 20
    assert max(high for _, high in bands) > 30_000
    with pytest.raises(SettingError, match='500 to 200'):
        area_bands((480, 640), 500, 200)


def test_an_empty_picture_has_no_circles():
    assert len(find_circles(np.zeros((60, 80), np.uint8))) == 0


def test_colour_is_refused():
    with pytest.raises(ImageFormatError, match='uint8'):
        find_circles(np.zeros((60, 80, 3), np.uint8))
