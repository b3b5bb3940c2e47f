"""A steered view turns smoothly, the short way round, and no farther than the panorama goes."""

import numpy as np
import pytest
from known_rigs import PAIR, RING, STAMP_NS, camera_at, deg, drawn, rig_of

from fisheye_core.errors import SettingError
from panorama_stitch.pipeline.live_view import LiveView
from panorama_stitch.pipeline.panorama import Panorama
from panorama_stitch.pipeline.steering import Steering
from panorama_stitch.pipeline.view_settings import ViewSettings

STEP_NS = 33_000_000
FASTEST_DEG = 240 * 0.033
LONG = 120


@pytest.fixture(scope='module')
def pair():
    return rig_of(PAIR)


@pytest.fixture(scope='module')
def ring():
    return rig_of(RING, is_closed=True)


def way(steering, layout, steps=LONG):
    """Return yaw, pitch and field of view, picture by picture, deg."""
    cameras = [steering.at(k * STEP_NS, layout) for k in range(steps)]
    return np.degrees([(c.yaw_rad, c.pitch_rad, c.hfov_rad) for c in cameras])


def test_it_turns_there_smoothly(pair):
    layout = pair[0].layout
    steering = Steering(camera_at(-60, 0, 60))
    steering.look(*np.radians((50, -8, 40)))
    angles = way(steering, layout)
    assert angles[0] == pytest.approx([-60, 0, 60])
    assert angles[-1] == pytest.approx([50, -8, 40])
    steps = np.diff(angles, axis=0)
    assert np.abs(steps).max() < FASTEST_DEG + 1e-6
    assert (steps[:, 0] >= 0).all(), 'without swinging past'
    assert (np.abs(steps[:, 0]) > 0).sum() > 10


def test_it_goes_no_farther_than_the_rig_sees(pair):
    compositor, images = pair
    for angles in ((179, 0, 60), (-179, 80, 60), (0, -90, 90), (170, 40, 170)):
        steering = Steering(camera_at(0, 0, 60))
        steering.look(*np.radians(angles))
        way(steering, compositor.layout)
        camera = steering.at(LONG * STEP_NS, compositor.layout)
        if np.degrees(camera.hfov_rad) < 100:
            assert drawn(compositor, images, camera)[0].seen_share > 0.999, angles


def test_what_is_behind_the_robot_is_reached_without_a_look_elsewhere():
    compositor, images = rig_of((deg(110, 0, 0), deg(-110, 0, 0)))
    steering = Steering(camera_at(120, 0, 60))
    steering.look(*np.radians((-130, -8, 40)))
    angles = way(steering, compositor.layout)
    assert angles[-1] == pytest.approx([-130, -8, 40])
    assert (np.diff(angles[:, 0] % 360) >= 0).all(), 'past the back'
    for yaw_deg in (-20, 20):
        steering.look(*np.radians((yaw_deg, 0, 60)))
        way(steering, compositor.layout)
        camera = steering.at(LONG * STEP_NS, compositor.layout)
        assert -180 <= np.degrees(camera.yaw_rad) < 180
        assert drawn(compositor, images, camera)[0].seen_share > 0.999
        assert np.sign(camera.yaw_rad) == np.sign(yaw_deg)


def test_around_a_ring_it_takes_the_short_way(ring):
    steering = Steering(camera_at(170, 0, 60))
    steering.look(*np.radians((-170, 0, 60)))
    angles = way(steering, ring[0].layout)
    assert (np.abs(angles[:, 0]) > 169.9).all()


def test_a_field_of_view_of_0_is_that_of_before(pair):
    steering = Steering(camera_at(0, 0, 60))
    steering.look(0.2, 0.0, 0.0)
    assert way(steering, pair[0].layout)[-1] == pytest.approx([np.degrees(0.2), 0, 60])


@pytest.mark.parametrize('bad', [(np.nan, 0, 0), (0, np.inf, 0), (0, 0, 3.1), (0, 0, -1)])
def test_nonsense_is_refused_and_changes_nothing(pair, bad):
    steering = Steering(camera_at(10, 0, 60))
    with pytest.raises(SettingError, match='of look'):
        steering.look(*bad)
    assert way(steering, pair[0].layout)[-1] == pytest.approx([10, 0, 60])


def test_a_view_at_rest_is_drawn_exactly_and_one_that_moves_soon(pair):
    compositor, images = pair
    settings = ViewSettings(width=320, height=240)
    exact = drawn(compositor, images, settings.camera('front'))[1]
    view, out = LiveView('front', settings), np.empty((240, 320, 3), np.uint8)
    came = []
    for k in range(12):
        view.look(0.0, 0.0, 0.0)
        panorama = Panorama(compositor, images, STAMP_NS + k * STEP_NS, 'bgr8', {})
        assert view.draw(panorama, view.aim(panorama), out)
        came.append(np.abs(out.astype(int) - exact).max())
    assert came[0] > 0
    assert came[-1] == 0


def test_a_view_that_was_steered_goes_back_to_rest(pair):
    settings = ViewSettings()
    view = LiveView('front', settings)
    panorama = Panorama(*pair, STAMP_NS, 'bgr8', {})
    view.look(0.5, 0.0, 0.0)
    view.apply(settings)
    assert view.moves
    view.rest()
    assert view.aim(panorama) == view.aim()


def test_what_silent_cameras_alone_see_is_not_drawn(pair):
    compositor, images = pair
    view, out = LiveView('left_view', ViewSettings()), np.empty((480, 640, 3), np.uint8)
    for stale, is_drawn in ((frozenset({0}), False), (frozenset({1}), True)):
        panorama = Panorama(compositor, images, 0, 'bgr8', {}, stale_cameras=stale)
        assert view.draw(panorama, view.aim(panorama), out) == is_drawn
