from dataclasses import replace

import numpy as np
import pytest
from turning import MOUNTS_DEG, lens_size, turn_sightings, turn_truth, turning_lens

from fisheye_core.errors import CalibrationError
from fisheye_geometry.attitude import Attitude, angle_between
from panorama_stitch.turn.bundle import adjust
from panorama_stitch.turn.halves import halves_of
from panorama_stitch.turn.turn_state import WIDTH, TurnState

NOISE_PX = 0.15
FOCAL, ROTATION_DEG, VERTICAL_DEG = 0.003, 0.1, 0.05
SIGMAS = 4.0
SLOPE = 1e-4
SIZES = dict.fromkeys(MOUNTS_DEG, lens_size(turning_lens()))


def start_from(truth: TurnState) -> TurnState:
    """A rough guess: no distortion, on the axis, everything equally near."""
    rng = np.random.default_rng(3)
    lenses = np.zeros_like(truth.lenses)
    lenses[:, :2] = truth.lenses[:, :2] * 1.02
    lenses[:, 2:4] = (np.array(lens_size(turning_lens())) - 1) / 2
    turns = [Attitude(0.0, 0.02, -0.02).matrix, Attitude(0.01, -0.02, 0.01).matrix]
    return replace(
        truth,
        lenses=lenses,
        attitudes=truth.attitudes @ np.array(turns),
        places=np.zeros((2, 3)),
        angles=truth.angles + np.append(0.0, rng.normal(0, 0.01, len(truth.angles) - 1)),
        nearness=np.full_like(truth.nearness, 0.3),
    )


@pytest.fixture(scope='module')
def fitted():
    truth = turn_truth(off_m=0.15)
    seen = turn_sightings(truth, NOISE_PX, outliers=0.03)
    return truth, adjust(start_from(truth), seen, SIZES, yaws_known=True)


def test_derivatives_are_those_of_the_prediction():
    truth = turn_truth(off_m=0.15, landmarks=12, frames=5)
    seen = turn_sightings(truth, 0.0)
    by_camera, by_angle, by_landmark = truth.derivatives(seen)
    rng = np.random.default_rng(4)
    step = rng.normal(size=truth.rig_count + 3 * len(truth.directions)) * 1e-6
    cameras, angles, landmarks = np.split(step, [2 * WIDTH, truth.rig_count])
    expected = np.einsum('nij,nj->ni', by_camera, cameras.reshape(2, -1)[seen.camera])
    expected += by_angle[..., 0] * angles[seen.frame, None]
    expected += np.einsum('nij,nj->ni', by_landmark, landmarks.reshape(-1, 3)[seen.landmark])
    moved = truth.moved(step).predict(seen) - truth.predict(seen)
    assert np.abs(moved - expected).max() < SLOPE * np.abs(expected).max()


def test_a_rig_off_the_axis_in_a_room_with_wrong_sightings(fitted):
    truth, fit = fitted
    state = fit.state
    assert np.abs(state.lenses[:, 0] / truth.lenses[:, 0] - 1).max() < FOCAL
    between, true = (a[0].T @ a[1] for a in (state.attitudes, truth.attitudes))
    assert np.degrees(angle_between(between, true)) < ROTATION_DEG
    tilt = np.linalg.norm(state.attitudes[:, 1] - truth.attitudes[:, 1], axis=1)
    assert np.degrees(tilt).max() < VERTICAL_DEG
    assert fit.noise_px == pytest.approx(NOISE_PX, rel=0.15)


@pytest.mark.parametrize('nearness', [1.0, 5.0])
def test_a_rig_on_the_axis_that_seemed_to_be_off_it(nearness):
    """Where all is equally near, that explains a focal length that is 7 % too short."""
    truth = turn_truth(off_m=0.0)
    start = start_from(truth)
    start.lenses[:, :2] = 0.93 * truth.lenses[:, :2]
    ahead = 0.05 * truth.attitudes[:, :, 2]
    start = replace(start, places=ahead, nearness=np.full_like(start.nearness, nearness))
    seen = turn_sightings(truth, NOISE_PX)
    state = adjust(start, seen, SIZES, yaws_known=True).state
    assert np.abs(state.lenses[:, 0] / truth.lenses[:, 0] - 1).max() < FOCAL


def test_deviations_are_those_of_the_errors(fitted):
    truth, fit = fitted
    error = fit.state.lenses - truth.lenses
    variance = np.diag(fit.covariance)[: 2 * WIDTH].reshape(2, WIDTH)[:, :8]
    assert np.all(variance > 0)
    assert np.abs(error / np.sqrt(variance)).max() < SIGMAS


def test_halves_of_true_sightings_agree(fitted):
    assert halves_of(fitted[1], SIZES).scale < 2.0


@pytest.mark.parametrize('jolted', [0, 7])
def test_a_frame_that_nods_is_left_out(jolted):
    truth = turn_truth(off_m=0.15, landmarks=120)
    nod = Attitude(0.0, np.radians(5), np.radians(3)).matrix
    steady = turn_sightings(truth, NOISE_PX)
    nodding = turn_sightings(replace(truth, attitudes=nod @ truth.attitudes), NOISE_PX)
    seen = steady.only(steady.frame != jolted).and_(nodding.only(nodding.frame == jolted))
    fit = adjust(truth, seen, SIZES, yaws_known=True)
    assert set(range(len(truth.angles))) - set(fit.seen.frame) == {jolted}
    assert np.abs(fit.state.lenses[:, 0] / truth.lenses[:, 0] - 1).max() < FOCAL
    assert np.sqrt(np.diag(fit.covariance)).max() < 1  # nothing drifts
    assert halves_of(fit, SIZES).scale < 2.0


def test_a_camera_that_saw_nothing_is_named(fitted):
    fit = fitted[1]
    left = fit.seen.only(fit.seen.camera == 0)
    with pytest.raises(CalibrationError, match='nothing that right saw fits a turn'):
        adjust(fit.state, left, SIZES, yaws_known=True)
    x, _, z = fit.state.directions[fit.seen.landmark].T
    is_even = np.arctan2(x, z) // np.radians(20) % 2 == 0
    one_half = replace(fit, seen=fit.seen.only((fit.seen.camera == 0) | is_even))
    with pytest.raises(CalibrationError, match='nothing that right saw fits a turn'):
        halves_of(one_half, SIZES)


def test_how_far_off_the_axis_shows_only_against_how_near_things_are():
    truth = turn_truth(off_m=0.15, landmarks=20, frames=6)
    seen = turn_sightings(truth, 0.0)
    assert np.allclose(truth.scaled(2.0).predict(seen), truth.predict(seen))
