import cv2
import numpy as np
import pytest
from conftest import seen_exactly
from rendered_view import scattered_poses

from fisheye_undistort.fit.estimate import Estimate, TargetView
from fisheye_undistort.fit.first_guess import first_guess
from fisheye_undistort.fit.lens_fit import GROUPS, FitProblem, damp, fit
from fisheye_undistort.fit.lens_prior import usual_lens
from fisheye_undistort.fit.sheet_model import UNKNOWNS, lens_of, project, warp_board
from fisheye_undistort.target.target import Target

TARGET = Target('circles', 4, 5, 40, 40, radius_mm=15)
UNKNOWN_TRUTH = np.array([215, 216, 322, 238, 0.02, -0.01, 0.003, -0.0008, 1.5, -0.5, 0.8])
SLOPE = 1e-5
"""Central differences of float64 are good to this share."""


@pytest.fixture(scope='module')
def views(paper_lens):
    return [
        seen_exactly(paper_lens, TARGET, pose, str(i))
        for i, pose in enumerate(scattered_poses(paper_lens, TARGET, 6, (120, 200)))
    ]


def numeric(function, at, step=1e-6):
    """Central differences along each coordinate, in the last axis."""
    return np.stack(
        [(function(at + d) - function(at - d)) / (2 * step) for d in step * np.eye(len(at))],
        axis=-1,
    )


def test_the_projection_is_the_lenss_own():
    rays = np.random.default_rng(0).normal(size=(100, 3))
    lens = lens_of(UNKNOWN_TRUTH, (640, 480))
    pixels, seen = lens.project(rays)
    assert seen.sum() > 50
    assert np.allclose(project(UNKNOWN_TRUTH, rays)[0][seen], pixels[seen], atol=1e-9)


@pytest.mark.parametrize('ray', [(0.3, -0.2, 1.0), (0.9, 0.5, -0.1), (1e-4, 0, 1), (0, 2, 0.3)])
def test_derivatives_of_the_projection(ray):
    ray = np.array(ray, float)
    _, by_intrinsics, by_point = project(UNKNOWN_TRUTH, ray[None])
    expected = numeric(lambda p: project(UNKNOWN_TRUTH, p[None])[0][0], ray)
    assert np.allclose(by_point[0], expected, rtol=SLOPE, atol=1e-3)
    expected = numeric(lambda u: project(u, ray[None])[0][0], UNKNOWN_TRUTH)
    assert np.allclose(by_intrinsics[0], expected[:, :8], rtol=SLOPE, atol=1e-3)


def test_derivatives_of_the_whole_problem(views):
    nominal = np.concatenate([UNKNOWN_TRUTH[:4] + 5, np.zeros(7)])
    problem = FitProblem(views, TARGET.points_mm, nominal, tuple(GROUPS), None)
    poses = np.tile([0.2, -0.1, 0.3, 10.0, 5.0, 180.0], (len(views), 1))
    vector = problem.pack(Estimate(UNKNOWN_TRUTH, poses))
    _, by_shared, by_pose = problem.jacobian(vector)
    expected = numeric(lambda v: problem.jacobian(v)[0], vector)
    limit = 1e-4 * np.abs(expected).max()
    shared = by_shared.shape[2]
    assert np.allclose(by_shared, expected[..., :shared], rtol=1e-4, atol=limit)
    of_view = expected[..., shared:].reshape(len(views), 20, 2, len(views), 6)
    for number, own in enumerate(np.split(by_pose, len(views))):
        assert np.allclose(own, of_view[number, ..., number, :], rtol=1e-4, atol=limit)
        others = np.delete(of_view[number], number, axis=2)
        assert np.all(others == 0)


def test_a_step_of_the_blocks_is_that_of_the_whole_matrix(views):
    nominal = np.concatenate([UNKNOWN_TRUTH[:4] + 5, np.zeros(7)])
    prior = usual_lens(nominal, (640, 480), TARGET.points_mm, 0.1)
    problem = FitProblem(views, TARGET.points_mm, nominal, tuple(GROUPS), prior=prior)
    poses = np.tile([0.2, -0.1, 0.3, 10.0, 5.0, 180.0], (len(views), 1))
    vector = problem.pack(Estimate(UNKNOWN_TRUTH, poses))
    residuals, by_shared, by_pose = problem.jacobian(vector)
    whole = np.zeros((len(residuals), 2, len(vector)))
    whole[..., : by_shared.shape[2]] = by_shared
    for number, own in enumerate(np.split(by_pose, len(views))):
        at = by_shared.shape[2] + 6 * number
        whole[20 * number : 20 * (number + 1), :, at : at + 6] = own
    known = prior.residuals(problem.unpack(vector)[0])
    by_known = np.zeros((len(known), len(vector)))
    by_known[:, : by_shared.shape[2]] = prior.root @ np.concatenate([*GROUPS.values()]).T
    whole = np.concatenate([whole.reshape(-1, len(vector)), by_known])
    residuals = np.concatenate([residuals.ravel(), known])
    normal = whole.T @ whole
    damped = normal + 0.01 * np.diag(np.diag(normal))
    expected = -np.linalg.solve(damped, whole.T @ residuals)
    step, promised = problem.normal_equations(vector).step(0.01)
    assert np.allclose(step, expected, rtol=1e-5)
    left = residuals + whole @ step
    assert np.isclose(promised, residuals @ residuals - left @ left, rtol=1e-6)


def test_far_points_count_linearly():
    residuals = np.array([-100.0, -0.01, 0.0, 0.01, 100.0])
    damped, _ = damp(residuals)
    assert np.allclose(damped[1:4], residuals[1:4], rtol=1e-4)
    assert np.allclose(damped[[0, 4]] ** 2, 2 * 100, rtol=0.02)
    assert np.all(np.sign(damped) == np.sign(residuals))


def test_a_bulge_is_zero_in_the_middle_and_full_at_the_edge():
    warped = warp_board(TARGET.points_mm, np.array([2.0, 0.0, 0.0]))
    assert np.allclose(warped[:, :2], TARGET.points_mm[:, :2])
    assert np.allclose(warped[::5, 2], 2.0)
    assert np.allclose(warped[2::5, 2], 0.0)


def test_deviations_are_those_of_repeated_fits(views):
    noise_px = 0.2
    nominal = np.zeros(len(UNKNOWNS))
    nominal[:4] = 210, 210, 319.5, 239.5
    free = ('focal length', 'k1', 'principal point', 'k2')
    random = np.random.default_rng(4)
    results, claimed = [], []
    poses = first_guess(views, TARGET.points_mm, (640, 480)).poses
    for _ in range(30):
        noisy = [
            TargetView(v.name, v.points_px + random.normal(0, noise_px, v.points_px.shape), v.ids)
            for v in views
        ]
        estimate = fit(noisy, TARGET.points_mm, Estimate(nominal, poses), nominal, free)
        results.append(estimate.unknowns)
        claimed.append(np.sqrt(np.diag(estimate.covariance)))
    scatter, claimed = np.std(results, axis=0), np.mean(claimed, axis=0)
    fitted = claimed > 0
    assert fitted.sum() == 6
    # Thirty repetitions know a deviation to 13 %. Six views know their own scatter badly, so what
    # is claimed of them is generous.
    ratio = claimed[fitted] / scatter[fitted]
    assert np.all((ratio > 0.9) & (ratio < 3))


def test_deviations_are_those_of_views_that_are_bent_anew_each_time(paper_lens):
    """Points of a view are wrong together: what their own scatter says is far too little."""
    nominal = np.concatenate([UNKNOWN_TRUTH[:8], np.zeros(3)])
    free = ('focal length', 'k1', 'principal point', 'k2')
    poses = scattered_poses(paper_lens, TARGET, 16, (120, 200))
    start = np.array([[*cv2.Rodrigues(p.rotation)[0].ravel(), *p.translation_mm] for p in poses])
    random = np.random.default_rng(4)
    results, claimed = [], []
    for _ in range(30):
        views = []
        for pose in poses:
            bent = warp_board(TARGET.points_mm, random.normal(0, 0.7, 3))
            pixels = paper_lens.project(bent @ pose.rotation.T + pose.translation_mm)[0]
            pixels += random.normal(0, 0.02, pixels.shape)
            views.append(TargetView('', pixels, np.arange(len(bent))))
        estimate = fit(views, TARGET.points_mm, Estimate(nominal, start), nominal, free)
        results.append(estimate.unknowns)
        claimed.append(np.sqrt(np.diag(estimate.covariance)))
    scatter, claimed = np.std(results, axis=0), np.mean(claimed, axis=0)
    fitted = claimed > 0
    ratio = claimed[fitted] / scatter[fitted]
    assert np.all((ratio > 0.8) & (ratio < 2.5))
