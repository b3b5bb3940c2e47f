"""The command snapshot as users run it."""

import json
import os
import re
import subprocess
from pathlib import Path

import cv2
import pytest
from ament_index_python.packages import get_package_prefix
from known_rigs import synthetic_rig

from fisheye_testing.rig import camera_parameters
from fisheye_testing.waiting import wait_for

COMMAND = Path(get_package_prefix('panorama_viewer')) / 'lib' / 'panorama_viewer' / 'snapshot'
START_S = 40.0


@pytest.fixture
def snapshot(domain, tmp_path):
    def run(*arguments):
        environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
        return subprocess.run(
            [COMMAND, *map(str, arguments)],
            env=environment,
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=2 * START_S,
        )

    return run


def test_it_saves_the_panorama_with_its_projection(rig, watcher, snapshot, tmp_path):
    rig.start_all(True, camera_parameters(None))
    wait_for(lambda: rig.check_alive() or watcher.newest, START_S, 'a first panorama')
    done = snapshot('--timeout', START_S)
    assert (done.returncode, done.stderr) == (0, '')
    described = json.loads((tmp_path / 'panorama.json').read_text())['projection']
    size = cv2.imread(str(tmp_path / 'panorama.png')).shape[1::-1]
    assert size == (described['width'], described['height'])
    done = snapshot('--format', 'gpano', '--out', 'here', '--timeout', START_S)
    assert (done.returncode, done.stdout) == (0, 'Saved here.jpg\n')
    assert b'GPano:FullPanoWidthPixels' in (tmp_path / 'here.jpg').read_bytes()


def test_a_photo_sphere_of_a_ring_is_all_around(rig, watcher, snapshot, tmp_path):
    ring = synthetic_rig('ring3')
    rig.start_all(True, ring.cameras, **ring.common, frame_rate_hz=5.0)
    wait_for(
        lambda: rig.check_alive() or (watcher.projection and watcher.projection.wraps),
        START_S,
        'a closed panorama',
    )
    done = snapshot('--format', 'gpano', '--timeout', START_S)
    assert (done.returncode, done.stderr) == (0, '')
    tags = dict(
        re.findall(r'GPano:(\w+)="(\w+)"', (tmp_path / 'panorama.jpg').read_text('latin1'))
    )
    assert tags['CroppedAreaImageWidthPixels'] == tags['FullPanoWidthPixels']
    assert tags['CroppedAreaLeftPixels'] == '0'
    assert cv2.imread(str(tmp_path / 'panorama.jpg')).shape[1] == int(tags['FullPanoWidthPixels'])


def test_without_a_panorama_it_says_so(snapshot):
    done = snapshot('--timeout', 0.2, '--ros-args', '-r', '__ns:=/nowhere')
    assert done.returncode == 1
    expected = 'snapshot: no panorama came on /nowhere/panorama/image within 0.2 s\n'
    assert done.stderr == expected
