"""A drive over bumps: the page, views and snapshots stay level while the rig nods."""

import json
import os
import re
import subprocess
from base64 import b64decode
from pathlib import Path

import cv2
import numpy as np
import pytest
from ament_index_python.packages import get_package_prefix
from diagnostic_msgs.msg import DiagnosticArray
from fisheye_msgs.msg import Projection
from nodding import GROUND, MOUNTS, NOD_RAD, SKY, Drive, nod
from sensor_msgs.msg import Image
from viewer_page import page_of

from fisheye_bridge.stamps import ns_of
from fisheye_geometry.attitude import angle_between, attitude_of
from fisheye_testing.image_message import to_array
from fisheye_testing.waiting import wait_for

START_S = 60.0
LEVEL_DEG = 0.5
UNKNOWN_PX = 0.5
"""Where between two pixels a horizon is nobody can tell."""
SHOTS = 4
"""Of the page, one after the other, each of another picture: what is right by chance is not so
often. A machine without time for the IMU's messages may have to try again."""
IMUS = [True, False] if os.environ.get('LONG') == '1' else [True]
"""Whether the IMU gives an orientation, or accelerations and turns."""
SETTLED_S = 3
PICTURES = 6
FOCAL_PX = 320
SNAPSHOT = Path(get_package_prefix('panorama_viewer')) / 'lib' / 'panorama_viewer' / 'snapshot'


def horizon(grey, around, reach):
    """Return the row of the horizon in each column of a picture, looked for around a row."""
    top = max(0, round(around - reach))
    band = grey[top : round(around + reach)].astype(float)
    bright = (band > (SKY + GROUND) / 2).sum(axis=0)
    return top + bright - 0.5


@pytest.fixture(scope='module')
def seen():
    """Return what the projections said, the newest pictures of views, and diagnostics."""
    return {'projections': [], 'overlaps': 0, 'status': {}, 'views': {}}


@pytest.mark.parametrize('has_orientation', IMUS, ids=lambda one: 'fused' if one else 'raw')
def test_a_drive_over_bumps(rig, watcher, domain, browser, seen, tmp_path, has_orientation):
    listen(watcher.node, seen)
    drive = Drive(watcher.node, has_orientation)
    try:
        rig.start(
            'panorama',
            level='imu',
            views='[front, fixed]',
            crop='none',
            max_pair_skew_s=0.01,  # of two moments nothing is level
            stale_after_s=10.0,
            **{f'{side}.source': 'topic' for side in MOUNTS},
            **{'front.stabilise': True},
        )
        wait_for(
            lambda: rig.check_alive() or (watcher.is_measured and has_settled(seen)),
            START_S,
            'a measured rig that is laid out for good',
        )
        seen['projections'].clear()
        page = page_of(rig, browser, width=1600, height=1000)
        page.until(lambda: 'Live' in page.text('condition'), 'a live page')
        stays = Stays()
        wait_for(lambda: stays(page_error_deg(browser, watcher)), START_S, 'a level page')
        wait_for(lambda: views_are_level(seen), START_S, 'level views')
        wait_for(lambda: snapshot_error_deg(domain, tmp_path) < LEVEL_DEG, START_S, 'a snapshot')
        check_orientations(seen['projections'])
        drive.has_imu = False
        words = 'nothing came on the topic imu for'
        wait_for(lambda: words in seen['status'].get('panorama', ''), START_S, 'a WARN')
    finally:
        drive.stop()


def listen(node, seen):
    seen.update(projections=[], status={}, views={})

    def diagnosed(message):
        seen['status'].update({status.name: status.message for status in message.status})

    node.create_subscription(DiagnosticArray, '/diagnostics', diagnosed, 10)
    node.create_subscription(Projection, 'panorama/projection', seen['projections'].append, 30)
    for view in ('front', 'fixed'):
        node.create_subscription(
            Image,
            f'{view}/image_raw',
            lambda message, view=view: seen['views'].setdefault(view, []).append(message),
            5,
        )


def surface(projection):
    return projection.width, projection.height, projection.center_x_px, projection.center_y_px


def has_settled(seen):
    """Whether panoramas of the last seconds all lie on one surface."""
    last = seen['projections'][-1:]
    since = [
        (last[0].header.stamp.sec - p.header.stamp.sec, surface(p) == surface(last[0]))
        for p in reversed(seen['projections'])
    ]
    recent = [same for seconds, same in since if seconds <= SETTLED_S]
    return len(recent) < len(since) and all(recent)


def check_orientations(projections):
    """Each projection tells how the robot nods at its own stamp, and nothing else changes."""
    last = surface(projections[-1])
    lately = [one for one in projections if surface(one) == last]
    assert len(lately) > 10
    assert len(set(map(surface, projections))) <= 2, 'its level may have settled late, once'
    apart = []
    for message in lately:
        q = message.orientation
        turn = attitude_of(q.x, q.y, q.z, q.w).matrix
        down = turn.T @ (0.0, 1.0, 0.0)  # where the panorama shows the world's down
        true = nod(ns_of(message.header.stamp)).matrix.T @ (0.0, 1.0, 0.0)
        apart.append(np.stack([down, true]))
    downs, trues = np.moveaxis(np.array(apart), 1, 0)
    # The panorama's own level against the robot's frame is one rotation for all.
    u, _, vt = np.linalg.svd(trues.T @ downs)
    laid = (u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt).T
    errors = np.degrees(np.arccos(np.clip(((trues @ laid.T) * downs).sum(axis=1), -1, 1)))
    assert np.median(errors) < LEVEL_DEG
    assert np.degrees(angle_between(laid, np.eye(3))) < 2 * np.degrees(NOD_RAD)


def whole(browser):
    """Return the canvas itself, grey: a warning that comes or goes would move a screenshot."""
    url = browser.execute_script("return document.getElementById('whole').toDataURL()")
    coded = np.frombuffer(b64decode(url.partition(',')[2]), np.uint8)
    shot = cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
    is_drawn = shot.max() > SKY / 2
    return (shot,) if is_drawn else ()  # it is empty while it gets another size


class Stays:
    """Whether something was level so often in a row, each time with another picture."""

    def __init__(self):
        self.row, self.last = 0, None

    def __call__(self, seen):
        error_deg, picture = seen
        if error_deg > LEVEL_DEG:
            self.row = 0
        elif picture != self.last:
            self.row += 1
        self.last = picture
        return self.row >= SHOTS


def page_error_deg(browser, watcher):
    """Return how far off level the horizon of the page is at most, and what is shown."""
    (shot,) = wait_for(lambda: whole(browser), START_S, 'a picture on the page')
    projection = watcher.projection
    scale = shot.shape[1] / projection.width
    row = (projection.center_y_px + 0.5) * scale - 0.5
    px_per_deg = np.radians(projection.focal_px) * scale
    columns = slice(round(0.1 * shot.shape[1]), round(0.9 * shot.shape[1]))
    found = horizon(shot[:, columns], row, 14 * px_per_deg)
    return (np.abs(found - row).max() - UNKNOWN_PX) / px_per_deg, shot.tobytes()


def views_are_level(seen):
    """Whether the last pictures of a stabilised view are level while a fixed one nods."""
    swings = []
    for view in ('front', 'fixed'):
        messages = seen['views'].get(view, [])[-PICTURES:]
        found = [horizon(to_array(m)[..., 0], 239.5, 100) - 239.5 for m in messages]
        if len(found) < PICTURES:
            return False
        swings.append(np.degrees(np.arctan2(np.abs(found).max(), FOCAL_PX)))
    return swings[0] < LEVEL_DEG and swings[1] > 0.7 * np.degrees(NOD_RAD)


def snapshot_error_deg(domain, folder):
    environment = {**os.environ, 'ROS_DOMAIN_ID': str(domain)}
    for words in (('--format', 'gpano', '--out', 'sphere'), ('--out', 'plain')):
        command = [SNAPSHOT, *words, '--timeout', '20']
        subprocess.run(command, env=environment, cwd=folder, check=True, timeout=40)
    plain = json.loads((folder / 'plain.json').read_text())
    assert set(plain['projection']['orientation']) == set('xyzw')
    sphere = cv2.imread(str(folder / 'sphere.jpg'), cv2.IMREAD_GRAYSCALE)
    tags = dict(re.findall(rb'GPano:(\w+)="(\w+)"', (folder / 'sphere.jpg').read_bytes()))
    px_per_deg = int(tags[b'FullPanoWidthPixels']) / 360
    row = int(tags[b'FullPanoHeightPixels']) / 2 - int(tags[b'CroppedAreaTopPixels']) - 0.5
    columns = slice(round(0.15 * sphere.shape[1]), round(0.85 * sphere.shape[1]))
    found = horizon(sphere[:, columns], row, 14 * px_per_deg)
    return (np.abs(found - row).max() - UNKNOWN_PX) / px_per_deg
