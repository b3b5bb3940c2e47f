"""Lenses: there and back, past 90 degrees, and nonsense refused."""

import numpy as np
import pytest

from fisheye_core.errors import CalibrationError
from fisheye_geometry.lens import MODELS, make_lens

EXACT_PX = 1e-6
"""Rounding of float64 through a polynomial and its inverse stays far below it."""

FISHEYE = make_lens(
    'equidistant',
    640,
    480,
    [223.05, 0, 319.5, 0, 223.05, 239.5, 0, 0, 1],
    [-0.02, 0.004, -0.001, 0.0001],
)
FOLDING = make_lens(
    'fisheye',
    1280,
    960,
    [392.1, 0.4, 631.8, 0, 393.1, 493.2, 0, 0, 1],
    [-0.1, 0.0, 0.0, 0.0],
)
PINHOLE = make_lens(
    'plumb_bob', 640, 480, [400, 0, 310, 0, 405, 250, 0, 0, 1], [-0.3, 0.1, 0.001, -0.002, -0.01]
)
RATIONAL = make_lens(
    'rational_polynomial',
    640,
    480,
    [400, 0, 320, 0, 400, 240, 0, 0, 1],
    [0.5, 0.1, 0.001, 0, 0.01, 0.8, 0.2, 0.02],
)
PRISM = make_lens(
    'rational_polynomial',
    640,
    480,
    [400, 0, 320, 0, 410, 240, 0, 0, 1],
    [-0.3, 0.1, 0.001, -0.002, -0.01, 0.02, 0.01, 0.001, 0.01, -0.004, 0.006, 0.003],
)
TILTED = make_lens(
    'rational_polynomial',
    640,
    480,
    [400, 0, 320, 0, 410, 240, 0, 0, 1],
    [*PRISM.distortion, 0.06, -0.04],
)
PLAIN = make_lens('plumb_bob', 640, 480, [400, 0, 320, 0, 400, 240, 0, 0, 1], [])
ANNULAR = make_lens(
    'annular', 640, 480, [230, 0, 319.5, 0, 230, 239.5, 0, 0, 1], [0.3, -0.4, 0.6, 1.0]
)
EXAMPLES = {
    'equidistant': FISHEYE,
    'fisheye': FOLDING,
    'plumb_bob': PINHOLE,
    'rational_polynomial': TILTED,
    'annular': ANNULAR,
}


def pixels_around(lens):
    x = np.linspace(-0.5, lens.width - 0.5, 161)
    y = np.linspace(-0.5, lens.height - 0.5, 121)
    return np.stack(np.meshgrid(x, y), axis=-1)


@pytest.mark.parametrize('model', MODELS)
def test_each_model_is_rebuilt_from_the_numbers_that_ros_gets(model):
    lens = EXAMPLES[model]
    assert type(lens) is MODELS[model]
    again = make_lens(lens.ros_model, lens.width, lens.height, lens.matrix, lens.distortion)
    assert again == lens
    assert len(lens.distortion) in lens.coefficient_counts
    assert 0 < lens.max_angle_rad <= np.pi
    rays, seen = lens.unproject(pixels_around(lens))
    back, still_seen = lens.project(rays)
    assert seen.any()
    assert still_seen[seen].all()
    assert np.abs(back - pixels_around(lens))[seen].max() < EXACT_PX


@pytest.mark.parametrize('lens', [FISHEYE, FOLDING, PINHOLE, RATIONAL, PRISM, TILTED, PLAIN])
def test_a_pixel_comes_back_from_its_ray(lens):
    pixels = pixels_around(lens)
    rays, seen = lens.unproject(pixels)
    back, still_seen = lens.project(rays)
    assert seen.mean() > 0.5
    assert still_seen[seen].all()
    assert np.abs(back - pixels)[seen].max() < EXACT_PX
    assert np.linalg.norm(rays[seen], axis=-1) == pytest.approx(1)


@pytest.mark.parametrize('lens', [FISHEYE, FOLDING])
def test_rays_come_back_up_to_the_largest_angle(lens):
    angle = np.linspace(0, lens.max_angle_rad - 1e-9, 2000)
    for around in (0.0, 1.0, 4.0):
        rays = np.stack(
            [np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle)], -1
        )
        pixels, seen = lens.project(rays)
        again, also_seen = lens.unproject(pixels)
        assert seen.all()
        assert also_seen.all()
        assert np.abs(lens.project(again)[0] - pixels).max() < EXACT_PX
    assert lens.max_angle_rad > np.pi / 2


def test_a_lens_whose_radius_stops_growing_ends_there():
    radii = FOLDING.project(
        np.stack([np.sin(a := np.linspace(0, FOLDING.max_angle_rad, 500)), 0 * a, np.cos(a)], -1)
    )[0][:, 0]
    assert (np.diff(radii) > 0).all()
    assert FOLDING.max_angle_rad < np.pi
    _, seen = FOLDING.project(np.array([0.0, 0.0, -1.0]))
    assert not seen


def test_a_ray_behind_the_camera_is_not_mirrored_into_the_picture():
    behind = np.radians(101)
    pixel, seen = FISHEYE.project(np.array([np.sin(behind), 0.0, np.cos(behind)]))
    assert seen
    assert pixel[0] > FISHEYE.width


def test_prism_and_tilt_are_those_of_the_formula():
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4, tau_x, tau_y = TILTED.distortion
    rays = np.random.default_rng(2).uniform((-0.5, -0.5, 0.5), (0.5, 0.5, 1.5), (40, 3))
    x, y = (rays[:, :2] / rays[:, 2:]).T
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    u = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + s1 * r2 + s2 * r2 * r2
    v = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + s3 * r2 + s4 * r2 * r2
    for lens, tilt_x, tilt_y in ((PRISM, 0.0, 0.0), (TILTED, tau_x, tau_y)):
        (cx, sx), (cy, sy) = ((np.cos(t), np.sin(t)) for t in (tilt_x, tilt_y))
        rotation = np.array([[cy, 0, -sy], [0, 1, 0], [sy, 0, cy]]) @ np.array(
            [[1, 0, 0], [0, cx, sx], [0, -sx, cx]]
        )
        onto_sensor = np.array(
            [
                [rotation[2, 2], 0, -rotation[0, 2]],
                [0, rotation[2, 2], -rotation[1, 2]],
                [0, 0, 1],
            ]
        )
        tilted = onto_sensor @ rotation @ np.stack([u, v, np.ones_like(u)])
        expected = np.stack([400 * tilted[0] / tilted[2] + 320, 410 * tilted[1] / tilted[2] + 240])
        np.testing.assert_allclose(lens.project(rays)[0], expected.T, atol=EXACT_PX)


def test_coefficients_of_nothing_are_nothing():
    matrix = PINHOLE.matrix
    lenses = [
        make_lens('rational_polynomial', 640, 480, matrix, [*PINHOLE.distortion, *zeros])
        for zeros in ([], [0] * 3, [0] * 7, [0] * 9)
    ]
    pixels = [lens.unproject(pixels_around(lens))[0] for lens in lenses]
    for others in pixels[1:]:
        np.testing.assert_allclose(others, pixels[0], atol=1e-12)
    assert [lens.ros_model for lens in lenses] == ['plumb_bob', *['rational_polynomial'] * 3]


def test_a_fifth_zero_of_a_fisheye_driver_is_left_out():
    again = make_lens('equidistant', 640, 480, FISHEYE.matrix, [*FISHEYE.distortion, 0.0])
    assert again == FISHEYE


def test_the_image_circle_limits_what_is_seen():
    lens = FISHEYE.with_max_angle(np.radians(60))
    _, seen = lens.project(
        np.array([[np.sin(1.0), 0, np.cos(1.0)], [np.sin(1.1), 0, np.cos(1.1)]])
    )
    assert seen.tolist() == [True, False]
    assert lens.angle_at(-0.5, 239.5) == pytest.approx(np.radians(60))


def test_the_field_of_view_across_the_picture():
    lens = make_lens('equidistant', 640, 480, [215.7, 0, 319.5, 0, 215.7, 239.5, 0, 0, 1], [0] * 4)
    assert lens.angle_at(-0.5, 239.5) == pytest.approx(320 / 215.7)


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'model': 'omnidirectional'}, 'omnidirectional.*expected one of equidistant'),
        ({'model': 'x\n' * 500}, r'^distortion model [^\n]{60} is not known'),
        ({'width': 0}, 'width is 0 px; expected 1 to'),
        ({'matrix': [0, 0, 1, 0, 1, 1, 0, 0, 1]}, 'focal_x_px is 0.0; expected'),
        ({'matrix': [1, 0, 1, 0, float('nan'), 1, 0, 0, 1]}, 'focal_y_px is nan; expected'),
        (
            {'matrix': [1, 0, float('inf'), 0, 1, 1, 0, 0, 1]},
            'must be finite numbers .*; found inf',
        ),
        ({'matrix': [1e300, 0, 1, 0, 1e300, 1, 0, 0, 1]}, r'1e\+300; expected a .*up to 1e\+06'),
        ({'distortion': [0.1, 0.2]}, '2 distortion coefficients; .*equidistant.* has 4'),
        ({'distortion': [0, 0, 0, 0, 0.1]}, '5 distortion coefficients; .*equidistant.* has 4'),
        ({'distortion': [0.1, 0.2, float('nan'), 0]}, 'finite numbers .*; found nan'),
    ],
)
def test_numbers_that_describe_no_lens_are_refused(change, words):
    good = {
        'model': 'equidistant',
        'width': 640,
        'height': 480,
        'matrix': [200, 0, 320, 0, 200, 240, 0, 0, 1],
        'distortion': [0, 0, 0, 0],
    }
    with pytest.raises(CalibrationError, match=words):
        make_lens(**{**good, **change})


def test_a_focal_length_of_nearly_nothing_is_refused():
    with pytest.raises(CalibrationError, match='focal_x_px is 1e-300; expected a number above 0'):
        make_lens('equidistant', 640, 480, [1e-300, -1, 0, 0, 1e-300, 0, 0, 0, 1], [0, 0, 0, 0])
