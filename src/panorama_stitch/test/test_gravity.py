"""Where down is at the time of a picture, from what an IMU says at others."""

import numpy as np
import pytest

from fisheye_geometry.attitude import Attitude
from fisheye_geometry.inertial import ImuReading
from panorama_stitch.pipeline.gravity import GravityHistory, angle_rad

DOWN = np.array([0.0, 1.0, 0.0])
STEP_S = 0.01
G = 9.81
ERROR_DEG = 0.5
"""Of the level, while a rig nods by 10 degrees at 1 Hz."""


def nod(seconds):
    """Return pitch and roll of a rig on a bad road, rad, and how fast they change."""
    w = 2 * np.pi
    return np.radians(10) * np.sin(w * seconds), np.radians(10) * w * np.cos(w * seconds)


def down_at(seconds):
    return Attitude(pitch_rad=nod(seconds)[0]).matrix.T @ DOWN


def ns(seconds):
    return 10**18 + round(seconds * 1e9)


def error_deg(history, seconds):
    return np.degrees(angle_rad(history.at(ns(seconds)), down_at(seconds)))


def drive(history, seconds=4.0, *, is_fused, has_gyro, bumps=0.0):
    """Feel a drive; return the worst error at times of pictures in its second half, deg."""
    random = np.random.default_rng(3)
    worst = 0.0
    for step in range(round(seconds / STEP_S)):
        now = step * STEP_S
        rate = nod(now)[1]
        # To the right is the axis about which a pitch up turns.
        turn = np.array([rate, 0.0, 0.0]) if has_gyro else None
        push = random.normal(0, bumps, 3)
        felt = down_at(now) * G + push
        reading = ImuReading(
            ns(now),
            down_at(now) if is_fused else felt / np.linalg.norm(felt),
            is_fused,
            0.0 if is_fused else float(np.linalg.norm(felt)),
            turn,
        )
        history.feel(reading)
        if now > seconds / 2:
            worst = max(worst, error_deg(history, now - 0.034))
    return worst


@pytest.mark.parametrize('has_gyro', [False, True])
def test_an_orientation_is_interpolated_to_the_picture(has_gyro):
    assert drive(GravityHistory(), is_fused=True, has_gyro=has_gyro) < 0.05


def test_accelerations_and_turns_make_a_level():
    assert drive(GravityHistory(), 8.0, is_fused=False, has_gyro=True, bumps=0.5) < ERROR_DEG


def test_accelerations_alone_are_averaged():
    history = GravityHistory()
    down = Attitude(pitch_rad=0.1).matrix.T @ DOWN
    random = np.random.default_rng(1)
    for step in range(300):
        felt = down * G + random.normal(0, 0.5, 3)
        length = float(np.linalg.norm(felt))
        history.feel(ImuReading(ns(step * STEP_S), felt / length, False, length))
    assert np.degrees(angle_rad(history.at(ns(3.0)), down)) < 1.5


def test_a_picture_newer_than_the_last_reading_is_levelled_by_the_turn():
    history = GravityHistory()
    drive(history, 1.0, is_fused=True, has_gyro=True)
    assert error_deg(history, 1.0 + 0.02) < 0.2
    held = history.at(ns(50.0))
    assert np.degrees(angle_rad(held, down_at(0.99))) < 4, 'held after the last turn'


def test_one_wild_message_is_not_believed_and_a_lasting_change_is():
    history = GravityHistory()
    drive(history, 1.0, is_fused=True, has_gyro=False)
    wild = Attitude(roll_rad=1.0).matrix.T @ DOWN
    assert history.feel(ImuReading(ns(1.0), wild)) is None
    assert history.jump_deg == pytest.approx(57, abs=1)
    assert error_deg(history, 0.99) < 0.1
    for step in range(1, 40):
        history.feel(ImuReading(ns(1.0 + step * STEP_S), wild))
    assert np.degrees(angle_rad(history.at(ns(1.4)), wild)) < 0.1


def test_a_clock_that_is_set_back_starts_anew():
    history = GravityHistory()
    drive(history, 1.0, is_fused=True, has_gyro=False)
    history.feel(ImuReading(ns(-100.0), DOWN))
    assert history.at(ns(-100.0)) == pytest.approx(DOWN)


def test_nothing_is_known_before_anything_was_felt():
    assert GravityHistory().at(0) is None
