"""The prior must hold real lenses, and let data decide where there are any."""

import numpy as np
import pytest

from fisheye_undistort.fit.lens_prior import assumed_deviations, usual_distortion, usual_lens
from fisheye_undistort.fit.sheet_model import UNKNOWNS
from fisheye_undistort.target.target import STANDARD

ANGLES = np.radians(np.arange(1.0, 91.0))
SIZE = (640, 480)
UNKNOWN = np.array([200.0, 200, 320, 240, 0, 0, 0, 0, 0, 0, 0])
POINTS_MM = STANDARD['circles'].points_mm
WITHIN = 3.0


@pytest.mark.parametrize(
    'curve',
    [
        pytest.param(lambda t: t, id='equidistant'),
        pytest.param(lambda t: 2 * np.sin(t / 2), id='equisolid'),
        pytest.param(lambda t: 2 * np.tan(t / 2), id='stereographic'),
        pytest.param(np.sin, id='orthographic'),
        # What was published of a tracking camera, and what the tests' lenses have.
        pytest.param(
            lambda t: t * (1 - 0.00626 * t**2 + 0.0437 * t**4 - 0.0413 * t**6 + 0.00727 * t**8),
            id='T265',
        ),
        pytest.param(
            lambda t: t * (1 - 0.03 * t**2 + 0.003 * t**4 - 0.006 * t**6 + 0.0015 * t**8),
            id='190 degrees',
        ),
    ],
)
def test_lenses_that_there_are_lie_within(curve):
    mean, covariance = usual_distortion()
    powers = ANGLES[:, None] ** [2, 4, 6, 8]
    growth = curve(ANGLES) / ANGLES - 1
    deviation = np.sqrt(np.einsum('ij,jk,ik->i', powers, covariance, powers))
    assert np.all(np.abs(growth - powers @ mean) < WITHIN * deviation)


def test_the_prior_costs_one_deviation_what_one_point_does():
    prior = usual_lens(UNKNOWN, SIZE, POINTS_MM, 0.1)
    moved = prior.mean.copy()
    moved[:2] = 200
    center = np.linalg.norm(prior.residuals(moved))
    moved[2] += 0.03 * 640
    assert np.isclose(np.hypot(center, 0.1), np.linalg.norm(prior.residuals(moved)))


def test_nothing_is_known_of_the_focal_length():
    deviations = dict(zip(UNKNOWNS, assumed_deviations(UNKNOWN, SIZE, POINTS_MM), strict=True))
    assert deviations['focal_x_px'] == np.inf
    assert np.isclose(deviations['center_x_px'], 0.03 * 640)
    assert np.isclose(deviations['warp_xx_mm'], 1.0)
