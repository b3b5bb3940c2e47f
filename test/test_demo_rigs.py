"""The rigs of the demonstration: what is known of them, and a ring that runs."""

from math import degrees

import cv2
import numpy as np
import pytest
from known_rigs import SYNTHETIC_RIGS, folder_rig, synthetic_rig

from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.camera_file import Camera, write_camera
from fisheye_testing.waiting import wait_for

START_S = 60.0
CLOSE_DEG = 0.3


def test_rings_close_and_others_do_not():
    assert {name for name in SYNTHETIC_RIGS if synthetic_rig(name).is_closed} == {
        'ring3',
        'ring4',
        'back_to_back',
    }
    for name in SYNTHETIC_RIGS:
        rig = synthetic_rig(name)
        assert len(rig.between()) == len(rig.cameras) - (not rig.is_closed)
        if rig.is_closed:
            assert sum(degrees(each.yaw_rad) for each in rig.between()) == pytest.approx(360)


def test_a_folder_with_any_names(tmp_path):
    for name in ('rear', 'front'):
        write_camera(tmp_path / f'{name}.yaml', Camera(name, synthetic_lens(32, 24, np.pi)))
        cv2.imwrite(str(tmp_path / f'{name}.png'), np.zeros((24, 32, 3), np.uint8))
    for other in ('rig.yaml', 'overlap.yaml', 'panorama.png'):
        (tmp_path / other).touch()
    assert list(folder_rig(tmp_path).cameras) == ['front', 'rear']
    assert list(folder_rig(tmp_path, ['rear', 'front']).cameras) == ['rear', 'front']
    (tmp_path / 'truth.json').write_text('{"cameras": ["rear", "front"], "closed": true}')
    rig = folder_rig(tmp_path)
    assert (list(rig.cameras), rig.is_closed, rig.attitudes) == (['rear', 'front'], True, ())
    assert list(folder_rig(tmp_path, ['front']).cameras) == ['front']
    (tmp_path / 'front.png').unlink()
    with pytest.raises(FileNotFoundError, match=r'front.png is not there; expected .png and'):
        folder_rig(tmp_path)
    (tmp_path / 'rear.png').unlink()
    (tmp_path / 'truth.json').unlink()
    with pytest.raises(FileNotFoundError, match=r'/\*.png is not there; expected .png and'):
        folder_rig(tmp_path)


def test_a_ring_of_synthetic_cameras_is_closed_and_level(rig, watcher):
    known = synthetic_rig('ring4')
    rig.start_all(True, known.cameras, **known.common)
    wait_for(
        lambda: rig.check_alive() or (watcher.projection and watcher.projection.wraps),
        START_S,
        'a closed panorama',
    )
    wait_for(
        lambda: watcher.overlaps and all(each.found for each in watcher.overlaps.overlaps),
        START_S,
        'its overlaps',
    )
    for overlap, true in zip(watcher.overlaps.overlaps, known.between(), strict=True):
        assert overlap.found
        found = overlap.yaw_deg, overlap.pitch_deg, overlap.roll_deg
        expected = np.degrees([true.yaw_rad, true.pitch_rad, true.roll_rad])
        assert found == pytest.approx(expected, abs=CLOSE_DEG)
