"""The far edge: votes that are made so that the rotation and every distance are known."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from panorama_stitch.overlap.parallax import fit_far, halves_apart
from panorama_stitch.overlap.strips import seam_rays
from panorama_stitch.overlap.trial import Trial
from panorama_stitch.overlap.votes import Votes, chosen

SHARP_DEG = 0.1
NOISE_DEG = 0.15


def votes(step, parallax_deg, seed=0) -> Votes:
    """Votes all over an overlap of 30 by 120 degrees; each has a parallax."""
    rng = np.random.default_rng(seed)
    count = len(parallax_deg)
    u, v = np.radians([rng.uniform(-15, 15, count), rng.uniform(-60, 60, count)])
    right = seam_rays(u, v)
    zero = np.zeros_like(u)
    along = np.stack([np.cos(u), -np.sin(u) * np.sin(v), -np.sin(u) * np.cos(v)], axis=-1)
    across = np.stack([zero, np.cos(v), -np.sin(v)], axis=-1)
    noise = np.radians(rng.normal(0, NOISE_DEG, (2, count)))
    left = Rotation.from_rotvec(step).apply(right)
    left = (
        left + along * (np.radians(parallax_deg) + noise[0])[:, None] + across * noise[1][:, None]
    )
    left /= np.linalg.norm(left, axis=1, keepdims=True)
    deviation = np.full((count, 2), np.radians(NOISE_DEG))
    ones = np.ones(count)
    shown = np.stack([v, ones], axis=-1)
    return Votes(right, left, along, across, deviation, ones, ones, shown, float(count))


@pytest.mark.parametrize('share', [0.0, 0.3, 0.6])
def test_near_things_at_one_distance_do_not_win(share):
    step = np.radians([0.5, -1.0, 0.8])
    parallax = np.where(np.arange(300) < 300 * share, 3.0, 0.0)
    fit = fit_far(votes(step, parallax), scan=True)
    assert np.degrees(np.linalg.norm(fit.step - step)) < SHARP_DEG
    assert np.array_equal(fit.far, parallax == 0) or np.mean(fit.far == (parallax == 0)) > 0.95


def test_things_at_all_distances_do_not_become_a_tilt():
    step = np.radians([0.3, 0.6, -0.4])
    parallax = np.where(np.arange(400) < 200, 0.0, np.random.default_rng(1).uniform(0, 4, 400))
    fit = fit_far(votes(step, parallax), scan=True)
    assert np.degrees(np.linalg.norm(fit.step - step)) < 2 * SHARP_DEG


def test_scattered_false_votes_change_nothing():
    step = np.radians([-0.5, 0.7, 0.2])
    rng = np.random.default_rng(2)
    parallax = np.where(rng.random(400) < 0.3, rng.uniform(-6, 6, 400), 0.0)
    fit = fit_far(votes(step, parallax), scan=True)
    assert np.degrees(np.linalg.norm(fit.step - step)) < SHARP_DEG


def test_the_covariance_says_what_the_votes_support():
    errors, told = [], []
    for seed in range(20):
        fit = fit_far(votes(np.zeros(3), np.zeros(100), seed), scan=False)
        errors.append(fit.step)
        told.append(np.diag(fit.covariance))
    assert np.std(errors, axis=0) == pytest.approx(np.sqrt(np.mean(told, axis=0)), rel=0.6)


def test_too_few_votes_give_no_answer():
    assert fit_far(votes(np.zeros(3), np.zeros(3)), scan=True) is None


def test_halves_disagree_where_one_of_them_is_near():
    far = votes(np.zeros(3), np.zeros(300))
    fit = fit_far(far, scan=False)
    assert np.degrees(halves_apart(far, fit, far.height)) < SHARP_DEG
    # So little that it passes for far, and draws the whole fit with it.
    floor = votes(np.zeros(3), np.where(far.right[:, 1] > 0, 0.4, 0.0))
    fit = fit_far(floor, scan=False)
    assert np.degrees(halves_apart(floor, fit, floor.height)) > 2 * SHARP_DEG


def test_a_half_in_which_nothing_agrees_is_told():
    all_far = votes(np.zeros(3), np.zeros(300))
    upper = all_far.height < 0
    halved = chosen(all_far, upper)
    fit = fit_far(halved, scan=False)
    whole = Trial(np.eye(3), np.eye(3), all_far, fit_far(all_far, scan=False), 1.0)
    half = Trial(np.eye(3), np.eye(3), halved, fit, 1.0)
    assert whole.accounted > 0.9
    assert half.accounted < 0.1
    assert half.explained > 0.4
