"""The examples, run as a reader would run them."""

import json
import sys
from math import degrees, radians
from pathlib import Path

import cv2
import launching
import numpy as np
import pytest

from fisheye_geometry.camera_file import read_camera
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.remap import remap_table
from fisheye_testing.rig import SIDES
from fisheye_testing.waiting import wait_for
from fisheye_testing.watcher import Watcher

EXAMPLES = Path(__file__).parents[1] / 'examples'
START_S = 30.0
PATCH_PX = 40
ALIKE = 0.9
ANGLE_DEG = 0.5
"""Two whole columns, and what is measured."""
NOT_BLACK = 0.99
RED_BGR = (0, 0, 255)
COLOUR_TOLERANCE = 8
SAME_TOWN_DB = 20.0
"""Though the ball has moved on; upside down it is 9."""


def axis_px(panorama, folder, side):
    """Return the column of a panorama that shows what is ahead of a camera, and px per radian."""
    lens = read_camera(folder / f'{side}.yaml').lens
    surface = surface_for(lens, 'cylindrical')
    corrected = remap_table(lens, surface)(cv2.imread(str(folder / f'{side}.png')))
    x, y = round(surface.center_x_px), round(surface.center_y_px)
    ahead = corrected[y - PATCH_PX : y + PATCH_PX + 1, x - PATCH_PX : x + PATCH_PX + 1]
    score = cv2.matchTemplate(panorama, ahead, cv2.TM_CCOEFF_NORMED)
    assert score.max() > ALIKE
    return np.unravel_index(score.argmax(), score.shape)[1], surface.focal_px


def run_two_pictures(rig, folder, output):
    """Run the example; return its exit code and what it printed."""
    program = str(EXAMPLES / 'two_pictures.py')
    rig.run('example', [sys.executable, program, str(folder), str(output)])
    return rig.processes['example'].wait(START_S), rig.log('example').read_text()


def test_two_pictures_become_a_panorama_with_the_true_angle_between_them(rig, real_rig, tmp_path):
    folder, output = real_rig('workshop'), tmp_path / 'panorama.png'
    code, printed = run_two_pictures(rig, folder, output)
    assert code == 0, printed
    panorama = cv2.imread(str(output))
    (left_px, focal_px), (right_px, _) = (axis_px(panorama, folder, side) for side in SIDES)
    true_deg = json.loads((folder / 'truth.json').read_text())['yaw_deg']
    assert degrees((right_px - left_px) / focal_px) == pytest.approx(true_deg, abs=ANGLE_DEG)
    assert (panorama.max(axis=2) > 0).mean() > NOT_BLACK


def test_pictures_of_two_places_are_refused(rig, real_rig, tmp_path):
    for side, name in (('left', 'workshop'), ('right', 'park')):
        for suffix in ('png', 'yaml'):
            (tmp_path / f'{side}.{suffix}').symlink_to(real_rig(name) / f'{side}.{suffix}')
    output = tmp_path / 'panorama.png'
    code, printed = run_two_pictures(rig, tmp_path, output)
    assert code == 1
    assert printed == 'The pictures have too little in common.\n'
    assert not output.exists()


def wait_until_measured(rig, watcher):
    """Wait for the panorama that stays: until then two pictures stand side by side."""
    wait_for(lambda: rig.check_alive() or watcher.is_measured, START_S, 'a measured panorama')


@pytest.mark.parametrize('bearing_deg', [-100.0, 30.0])
def test_a_bearing_is_marked_where_the_projection_says(rig, watcher, bearing_deg):
    rig.start('panorama')
    program = str(EXAMPLES / 'mark_bearing.py')
    words = ['--ros-args', '-p', f'bearing_deg:={bearing_deg}']
    rig.run('example', [sys.executable, program, *words])
    wait_until_measured(rig, watcher)
    projection = watcher.projection
    size = projection.height, projection.width

    def marked_panorama():
        picture = watcher.picture_on('panorama/marked', START_S)
        return [picture] if picture.shape[:2] == size else []

    (marked,) = wait_for(marked_panorama, START_S, 'a mark in that projection')
    x_px = round(projection.center_x_px + projection.focal_px * radians(bearing_deg))
    difference = np.abs(marked[:, x_px].astype(int) - RED_BGR)
    assert difference.max() <= COLOUR_TOLERANCE
    beside = np.abs(marked[:, [x_px - 2, x_px + 2]].astype(int) - RED_BGR)
    assert beside.max(axis=(0, 2)).min() > COLOUR_TOLERANCE


def test_a_client_of_the_video_gets_the_panorama(rig, watcher, tmp_path):
    rig.start('panorama')
    wait_until_measured(rig, watcher)
    picture = tmp_path / 'picture.png'
    rig.run('example', [sys.executable, str(EXAMPLES / 'take_video.py'), str(picture)])
    code = rig.processes['example'].wait(START_S)
    assert code == 0, rig.log('example').read_text()
    taken, now = cv2.imread(str(picture)), watcher.picture()
    height, width = now.shape[:2]
    assert cv2.PSNR(taken[:height, :width], now) > SAME_TOWN_DB


@pytest.mark.parametrize('is_real', [False, True], ids=['rules', 'launch'])
def test_two_robots_have_a_panorama_each(rig, domain, is_real):
    if is_real and not launching.has_launch():
        pytest.skip(
            'launch and launch_ros are not installed (sudo apt install ros-jazzy-launch-ros)'
        )
    program, file = Path(launching.__file__), EXAMPLES / 'two_robots.launch.py'
    words = [f'REAL_LAUNCH={is_real:d}', sys.executable, str(program), str(file)]
    rig.run('launch', ['env', *words])
    with Watcher(domain, 'alpha') as alpha, Watcher(domain, 'bravo') as bravo:
        for robot in (alpha, bravo):
            wait_for(lambda robot=robot: rig.check_alive() or robot.newest, START_S, 'a panorama')
        for robot in (alpha, bravo):
            graph = robot.node.get_node_names_and_namespaces
            wait_for(
                lambda graph=graph: (
                    sorted(space for name, space in graph() if name == 'panorama')
                    == ['/alpha', '/bravo']
                ),
                START_S,
                'a node for each robot',
            )
    rig.stop('launch')
