import numpy as np
import pytest
from scenes import world
from turning import mounts, turn_pictures, turning_lens

from fisheye_core.errors import CalibrationError
from fisheye_geometry.attitude import Attitude
from panorama_stitch.turn.first_turn import first_camera, first_state
from panorama_stitch.turn.full_circle import closing_frame, has_come_round
from panorama_stitch.turn.sightings import joined

FRAMES = 36
FOCAL = 0.04
"""A first estimate knows of no distortion."""
TILT_DEG = 2.0


def corners(lens, mount: Attitude, turn_rad: float):
    """Pixels of the same far things before and after a turn to the right."""
    rays = np.random.default_rng(0).normal(size=(2000, 3))
    step = Attitude(turn_rad).matrix
    before, seen = lens.project(rays @ mount.matrix)
    after, still_seen = lens.project(rays @ step @ mount.matrix)
    seen &= still_seen
    for pixels in (before, after):
        seen &= np.all((pixels > 0) & (pixels < (lens.width - 1, lens.height - 1)), axis=1)
    return before[seen], after[seen]


@pytest.mark.parametrize('way', [1, -1])
def test_a_full_turn_tells_focal_length_and_axis(way):
    lens, mount = turning_lens(), mounts()[0]
    step = corners(lens, mount, way * 2 * np.pi / FRAMES)
    camera = first_camera([step] * (FRAMES - 1), step, FRAMES - 1, (320, 240), 'left')
    assert abs(camera.lens.focal_x_px / lens.focal_x_px - 1) < FOCAL
    seen = joined([(0, 0, np.arange(len(step[0])), step[0])])
    state = first_state([camera], seen, None)
    assert np.sign(state.angles[-1]) == way
    told, true = Attitude.of(state.attitudes[0]), mount
    assert np.degrees(abs(told.pitch_rad - true.pitch_rad)) < TILT_DEG
    assert np.degrees(abs(told.roll_rad - true.roll_rad)) < TILT_DEG


def test_an_upside_down_camera_needs_to_be_told_the_way():
    lens, mount = turning_lens(), Attitude(0.0, 0.1, np.pi)
    step = corners(lens, mount, 2 * np.pi / FRAMES)
    camera = first_camera([step] * (FRAMES - 1), step, FRAMES - 1, (320, 240), 'left')
    seen = joined([(0, 0, np.arange(len(step[0])), step[0])])
    told = Attitude.of(first_state([camera], seen, True).attitudes[0])
    assert abs(abs(np.degrees(told.roll_rad)) - 180) < TILT_DEG


def test_where_nothing_turns():
    step = corners(turning_lens(), mounts()[0], 0.0)
    with pytest.raises(CalibrationError, match='left shows moved around by 0 to 0 degrees'):
        first_camera([step] * 5, step, 5, (320, 240), 'left')


def test_the_turn_comes_round_where_the_first_picture_is_shown_again():
    angles = np.radians(np.arange(0, 385, 8.0))
    frames = list(turn_pictures(world(), turning_lens(), angles))
    assert closing_frame(frames) == 45
    assert not any(has_come_round(frames[:count]) for count in range(46))
    assert has_come_round(frames)
    with pytest.raises(CalibrationError, match='none of 40 pictures shows again'):
        closing_frame(frames[:40])
