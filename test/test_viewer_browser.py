"""The viewer's page in a real browser: headless Chromium."""

import math
import re
from dataclasses import replace

import cv2
import numpy as np
import pytest
import viewer_page
from chromium import browser_path, driver_path
from known_rigs import synthetic_rig
from selenium.webdriver import Keys
from viewer_page import (
    CLOSE_DEG,
    CLOSED,
    GREEN,
    MAGENTA,
    REAR,
    SEAM,
    SPOT_DEG,
    SURFACES,
    Page,
    aside_deg,
    page_of,
    painted,
    patch,
    where,
)

from fisheye_bridge.projection import surface_of
from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.surface import Surface
from fisheye_geometry.surface_kind import KINDS
from fisheye_testing.rig import camera_parameters
from panorama_viewer.projection import described

serve = viewer_page.serve  # its fixture

STRAIGHT_PX = 2.0
"""A line two pixels of the panorama wide, enlarged."""
BEHIND_DEG = 180.0
"""Where the edges of a closed panorama meet."""
WAVES = 125
"""Around a closed panorama: 12 pixels each."""
BACKGROUND = 27, 21, 16
"""Of the page, blue, green and red."""
OVERLAP_DEG = 50.0
"""Of two cameras of 170 degrees, 120 apart."""


@pytest.mark.parametrize('driver', ['chromedriver', 'chromium.chromedriver'])
def test_a_driver_is_found_as_a_package_and_as_a_snap_call_it(driver, tmp_path, monkeypatch):
    monkeypatch.setenv('PATH', str(tmp_path))
    assert (browser_path(), driver_path()) == (None, None)
    for name in ('chromium', driver):
        (tmp_path / name).touch(mode=0o755)
    assert (browser_path(), driver_path()) == (str(tmp_path / 'chromium'), str(tmp_path / driver))


def test_every_kind_of_surface_is_tried_here():
    assert [surface.kind for surface in SURFACES] == list(KINDS)


@pytest.mark.parametrize('surface', SURFACES, ids=lambda surface: surface.kind)
def test_the_page_knows_every_kind_of_surface_as_python_does(browser, serve, surface):
    server = serve(surface, painted(surface, 0, 0))
    Page(browser, server.url)
    pixels = np.array([[x, y] for x in (3.0, 500.0, 900.0) for y in (40.0, 300.0, 450.0)])
    rays, back, is_bearing = browser.execute_async_script(
        """
        const [message, pixels, done] = arguments;
        import('/geometry.js').then(({ Projection }) => {
          const projection = new Projection(message);
          const rays = pixels.map(([x, y]) => projection.ray(x, y));
          const { columnsAreBearings } = projection.kind;
          done([rays, rays.map((ray) => projection.pixel(ray)), columnsAreBearings]);
        });
        """,
        described(surface),
        pixels.tolist(),
    )
    assert np.array(rays) == pytest.approx(surface.unproject(pixels)[0], abs=1e-9)
    assert np.array(back) == pytest.approx(pixels, abs=1e-6)
    assert is_bearing == surface.yaw_is_column_shift


@pytest.mark.parametrize('surface', SURFACES, ids=lambda surface: surface.kind)
def test_the_bearing_under_a_known_pixel_is_right(browser, serve, surface):
    bearing_deg, height_deg = 31.0, 12.0
    server = serve(surface, painted(surface, bearing_deg, height_deg))
    page = Page(browser, server.url)
    shown_deg = page.point('whole', *patch(page, 'whole', MAGENTA).mean(axis=0))
    assert shown_deg == pytest.approx(bearing_deg, abs=CLOSE_DEG)
    page.find('toggle').click()
    page.press(Keys.ARROW_RIGHT + Keys.ARROW_UP + '+')
    shown_deg = page.point('look', *patch(page, 'look', MAGENTA).mean(axis=0))
    assert shown_deg == pytest.approx(bearing_deg, abs=CLOSE_DEG)
    height = page.text('bearing').split(' · ')[1]
    assert float(height.partition('°')[0]) == pytest.approx(height_deg, abs=CLOSE_DEG)


@pytest.mark.parametrize('surface', SURFACES, ids=lambda surface: surface.kind)
def test_straight_things_are_straight_when_one_looks_around(browser, serve, surface):
    server = serve(surface, painted(surface, 31.0, 12.0))
    page = Page(browser, server.url)
    page.find('toggle').click()
    page.press(Keys.ARROW_UP)
    bar = patch(page, 'look', GREEN).astype(float)
    assert np.ptp(bar[:, 0]) > 300
    slope, start = np.polyfit(*bar.T, 1)
    assert abs(slope * bar[:, 0] + start - bar[:, 1]).max() < STRAIGHT_PX + bar_height(bar)


def bar_height(bar):
    """Half the bar's own height, px."""
    return max(np.ptp(bar[bar[:, 0] == column, 1]) for column in np.unique(bar[:, 0])) / 2


@pytest.mark.parametrize('surface', CLOSED, ids=lambda surface: surface.kind)
@pytest.mark.parametrize('bearing_deg', [-176.0, BEHIND_DEG, 175.0])
def test_bearings_are_right_across_the_edge_of_a_closed_panorama(
    browser, serve, surface, bearing_deg
):
    server = serve(surface, painted(surface, bearing_deg, 12.0), wraps=True)
    page = Page(browser, server.url)
    patch(page, 'whole', MAGENTA)
    page.look_at(BEHIND_DEG)
    spot = patch(page, 'look', MAGENTA)
    assert np.ptp(spot, axis=0) == pytest.approx(2 * SPOT_DEG * 450 / 57.3, abs=4), 'one, whole'
    shown_deg = page.point('look', *spot.mean(axis=0))
    assert aside_deg(shown_deg, bearing_deg) == pytest.approx(0, abs=CLOSE_DEG)


@pytest.mark.parametrize('surface', CLOSED, ids=lambda surface: surface.kind)
def test_nothing_is_seen_of_the_edges_of_a_closed_panorama(browser, serve, surface):
    # Steepest at the edge, where a step would be the largest.
    around = (np.arange(surface.width) + 0.5) / surface.width
    waves = 128 + 90 * np.sin(math.tau * WAVES * around)
    image = np.broadcast_to(waves[:, None], (surface.height, surface.width, 3)).astype(np.uint8)
    server = serve(surface, image, wraps=True)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.look_at(BEHIND_DEG)
    page.press('+' * 20)
    page.until(lambda: np.ptp(page.shot('look')[200]) > 100, 'a picture')
    row = page.shot('look')[200].astype(int)
    assert abs(np.diff(row, axis=0)).max() < 15, 'neither a gap nor a step of one pixel'


def test_one_turns_without_end_on_a_closed_panorama_only(browser, serve):
    server = serve(CLOSED[0], painted(CLOSED[0], 0, 0), wraps=True)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    turns_deg = [page.turn() for _ in range(45)]
    assert sum(turns_deg) > 400
    assert np.ptp(turns_deg) < 0.1
    # One that does not lead quite around has ends.
    server.tell(projection=described(replace(CLOSED[0], focal_px=754 / math.radians(175))))
    for key, end_deg, what in ((Keys.ARROW_RIGHT, 175, 'right'), (Keys.ARROW_LEFT, -175, 'left')):

        def is_at_end(key=key, end_deg=end_deg):
            page.press(key * 5)  # the first may come before the page knows
            return page.bearing_deg == pytest.approx(end_deg, abs=CLOSE_DEG)

        page.until(is_at_end, f'the {what} end')


def test_the_map_of_a_closed_panorama_leads_across_its_edge(browser, serve):
    server = serve(CLOSED[0], np.full((560, 1508, 3), 90, np.uint8), wraps=True)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.look_at(BEHIND_DEG)

    def outlined():
        lines = (page.shot('map').min(axis=2) > 140).sum(axis=0)
        middle = len(lines) // 2
        sides = *lines[2:30], *lines[-30:-2]
        return min(sides) >= 2 and not lines[middle - 60 : middle + 60].any()

    page.until(outlined, 'an outline that leaves at one edge and comes in at the other')
    width, height = (page.find('map').size[name] for name in ('width', 'height'))
    for x in (1, width - 1):
        shown_deg = page.point('map', x, height / 2)
        assert aside_deg(shown_deg, BEHIND_DEG) == pytest.approx(0, abs=2 * CLOSE_DEG)


@pytest.mark.parametrize('surface', REAR, ids=lambda surface: surface.kind)
def test_all_of_what_cameras_see_behind_the_robot_is_reached(browser, serve, surface):
    server = serve(surface, painted(surface, -150.0, 12.0))
    page = Page(browser, server.url)
    spot = patch(page, 'whole', MAGENTA).mean(axis=0)
    assert page.point('whole', *spot) == pytest.approx(-150, abs=CLOSE_DEG)
    page.press('d')
    edges = ['45°', '\N{MINUS SIGN}45°']
    page.until(lambda: [page.text('left-edge'), page.text('right-edge')] == edges, f'{edges}')
    ticks = (page.shot('scale').max(axis=2) > 100).any(axis=0)
    assert all(part.any() for part in np.array_split(ticks, 9)), 'the scale is as long'
    page.press('v')
    page.until(lambda: abs(page.bearing_deg) == pytest.approx(180, abs=0.1), 'the middle')
    patch(page, 'look', MAGENTA)
    page.press('v')
    page.click('whole', *patch(page, 'whole', MAGENTA).mean(axis=0))
    page.until(lambda: page.find('look').is_displayed(), 'the view')
    spot = patch(page, 'look', MAGENTA).mean(axis=0)
    assert page.point('look', *spot) == pytest.approx(-150, abs=CLOSE_DEG)
    height, width = page.shot('look').shape[:2]
    assert spot == pytest.approx([width / 2, height / 2], abs=8)
    page.press(Keys.ARROW_RIGHT * 20)
    width, height = (page.find('map').size[name] for name in ('width', 'height'))
    page.click('map', width / 4, height / 2)
    page.leave()
    page.until(lambda: page.bearing_deg == pytest.approx(112.5, abs=2 * CLOSE_DEG), 'a turn')
    lines = np.flatnonzero((page.shot('map')[height // 2] > 140).all(axis=1))
    assert np.mean([lines.min(), lines.max()]) == pytest.approx(width / 4, abs=4)
    page.press(Keys.ARROW_RIGHT * 30)
    page.until(lambda: page.bearing_deg == pytest.approx(-45, abs=0.1), 'the right end')
    server.tell(projection=described(surface.window(300, 0, 600, surface.height)))
    page.until(lambda: abs(page.bearing_deg) == pytest.approx(180, abs=0.1), 'the middle again')


def test_each_of_many_frames_side_by_side_is_reached(browser, serve):
    surface = Surface('cylindrical', 1800, 560, 200.0, 899.5, 260.0)
    image = np.full((560, 1800, 3), 90, np.uint8)
    # A turn apart.
    image[230:290, 50:110], image[230:290, 1307:1367] = MAGENTA, GREEN
    server = serve(surface, image, orientation=quaternion(Attitude(0.0, 0.2, 0.0)))
    page = Page(browser, server.url)
    columns = {'seam_begin_px': 900, 'seam_end_px': 900, 'left_end_px': 900, 'right_begin_px': 900}
    overlap = {'left': 'left', 'right': 'right', 'found': False, 'words': '', **columns}
    server.tell(overlaps=[overlap])
    for color in (MAGENTA, GREEN):
        page.click('whole', *patch(page, 'whole', color).mean(axis=0))
        page.until(lambda: page.find('look').is_displayed(), 'the view')
        place = patch(page, 'look', color).mean(axis=0)
        height, width = page.shot('look').shape[:2]
        assert place == pytest.approx([width / 2, height / 2], abs=8)
        page.press('v')
    page.until(lambda: page.text('overlap') == 'none', 'the overlap')
    page.press('m')
    page.until(lambda: 'setup' in page.aids, 'the aid')
    middle = page.shot('whole')[:, width // 2 - 20 : width // 2 + 20]
    assert not len(where(middle, SEAM)), 'a ray would not tell of which frame it is'


@pytest.mark.parametrize('surface', [SURFACES[0], *REAR], ids=['ahead', *(s.kind for s in REAR)])
def test_a_panorama_of_a_robot_that_nods_is_shown_level(browser, serve, surface):
    nod = Attitude(*np.radians((0.0, 6.0, -4.0)))
    y, x = np.ogrid[: surface.height, : surface.width]
    is_up = (surface.rays(x, y) @ nod.matrix.T)[..., 1] < 0
    image = np.repeat(np.where(is_up, 220, 60).astype(np.uint8)[..., None], 3, axis=2)
    page = Page(browser, serve(surface, image, orientation=quaternion(nod)).url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    shot = page.shot('whole').max(axis=2)
    scale = shot.shape[1] / surface.width
    rows = slice(round((surface.center_y_px - 100) * scale), None)
    horizon_px = rows.start + (shot[rows] > 140).sum(axis=0)
    inner = slice(round(0.1 * len(horizon_px)), round(0.9 * len(horizon_px)))
    assert abs(horizon_px[inner] - (surface.center_y_px + 0.5) * scale).max() < 2


def test_a_phone_starts_by_looking_around(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    page = Page(browser, server.url, width=390, height=844)
    patch(page, 'look', MAGENTA)
    assert page.find('map').is_displayed()
    width = browser.execute_script('return document.documentElement.scrollWidth')
    assert width == 390, 'nothing sticks out'
    before_deg = float(page.find('bearing').get_attribute('data-bearing-deg'))
    for kind, places in (
        ('touchStart', [(195, 300)]),
        ('touchMove', [(95, 300)]),
        ('touchStart', [(95, 300), (295, 300)]),
        ('touchMove', [(55, 300), (335, 300)]),
        ('touchEnd', []),
    ):
        points = [{'x': x, 'y': y, 'id': i} for i, (x, y) in enumerate(places)]
        event = {'type': kind, 'touchPoints': points}
        browser.execute_cdp_cmd('Input.dispatchTouchEvent', event)

    def turned():
        after_deg = float(page.find('bearing').get_attribute('data-bearing-deg'))
        return after_deg > before_deg + 10

    page.until(turned, 'a turn to the right')


@pytest.mark.parametrize(('button', 'held'), [('right', 2), ('left', 1)])
def test_the_picture_does_not_stick_to_a_mouse_without_a_button(browser, serve, button, held):
    # A menu keeps the button's release from the page.
    page = Page(browser, serve(SURFACES[0], painted(SURFACES[0], 0, 0)).url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.press('v')
    page.until(lambda: page.find('map').is_displayed(), 'the map')
    for name in ('look', 'map'):
        page.mouse('Pressed', name, 60, 30, button, held)
        page.leave()
        before_deg = page.bearing_deg
        for x in (70, 90):
            page.mouse('Moved', name, x, 30)
        page.leave()
        assert page.bearing_deg == before_deg
        page.mouse('Released', name, 90, 30, button)


def test_a_drag_straight_up_turns_no_faster_than_one_can_follow(browser, serve):
    surface = Surface('equirectangular', 1300, 754, 240.0, 649.5, 376.5)
    page = Page(browser, serve(surface, painted(surface, 0, 0)).url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.press('v' + Keys.ARROW_UP * 12)
    page.until(lambda: page.text('bearing').endswith('90.0° up'), 'a look straight up')
    page.mouse('Pressed', 'look', 200, 50, 'left', 1)
    page.mouse('Moved', 'look', 190, 50, 'left', 1)
    page.mouse('Released', 'look', 190, 50, 'left')
    page.press(Keys.ARROW_DOWN * 10)
    page.leave()
    focal_px = page.find('look').size['width'] / 2
    turned_deg = math.degrees(10 / focal_px / 0.2)
    page.until(lambda: page.text('bearing').endswith(' · 0.0°'), 'a look at the horizon')
    assert page.bearing_deg == pytest.approx(turned_deg, abs=0.1)


def test_a_page_that_is_hidden_leaves_its_place(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    shown = browser.current_window_handle
    browser.switch_to.new_window('tab')
    page.until(lambda: server.watchers == 0, 'the page to leave')
    browser.close()
    browser.switch_to.window(shown)
    page.until(lambda: server.watchers == 1, 'the page to come back')


def test_a_surface_that_the_page_does_not_know_is_said(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), stale_after_s=1.0)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    server.tell(projection={**described(SURFACES[0]), 'surface': 'stereographic'})
    page.until(lambda: 'cannot show a stereographic panorama' in page.text('problems'), 'words')
    server.tell(projection=described(SURFACES[0]))
    page.until(lambda: not page.text('problems'), 'the end of it')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')


def test_pictures_without_a_projection_are_not_called_live(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    server.tell(projection=None)
    page = Page(browser, server.url)

    def told():
        server.tell(rate_hz=5.0)
        return page.text('problems')

    assert page.until(told, 'words') == (
        'pictures come, but panorama/projection does not: nothing can be shown'
    )
    assert page.text('condition') == 'Waiting for a picture'
    server.tell(projection=described(SURFACES[0]))
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    assert not page.text('problems')


def moves(before, after):
    """Whether two pictures of one size differ by more than noise."""
    return before.shape == after.shape and abs(before.astype(int) - after).max() > 100


def test_one_looks_straight_back_in_a_ring_of_cameras(browser, rig):
    ring = synthetic_rig('ring3')
    rig.start_all(True, ring.cameras, **ring.common, frame_rate_hz=5.0)
    page = page_of(rig, browser)
    page.until(lambda: re.match(r'[01]\.\d\d, .*, [01]\.\d\d', page.text('overlap')), 'a ring')
    page.until(lambda: page.text('condition').startswith('Live'), 'a live picture')
    assert page.find('overlap').get_attribute('title').count('° apart') == 3
    page.look_at(BEHIND_DEG)
    page.look_at(-90.0)
    page.look_at(BEHIND_DEG)
    background = abs(page.shot('look')[150:250].astype(int) - BACKGROUND).max(axis=2) < 2
    assert not background.all(axis=0).any(), 'no column is empty'
    page.press('m')
    rows = [0]

    def marked():
        nonlocal rows
        rows = (abs(page.shot('look').astype(int) - SEAM).max(axis=2) < 40).sum(axis=0)
        return max(rows) > 100

    page.until(marked, 'the mark of a seam')
    seam_deg = page.point('look', np.argmax(rows), 50)
    assert aside_deg(seam_deg, BEHIND_DEG) == pytest.approx(0, abs=OVERLAP_DEG / 2)


def test_the_whole_rig_in_a_browser(browser, rig, watcher):
    rig.start_all(False, camera_parameters(None), frame_rate_hz=10.0)
    page = page_of(rig, browser)
    page.until(lambda: re.match(r'[01]\.\d\d', page.text('overlap')), 'an overlap')
    page.until(lambda: page.text('condition').startswith('Live'), 'a live picture')
    page.until(lambda: moves(page.shot('whole'), page.shot('whole')), 'a movement')
    width = page.find('whole').size['width']

    def shows_the_bearing():
        # Page and watcher may stand on either side of a measured overlap for a moment.
        surface = surface_of(watcher.projection)
        x = 0.75 * surface.width - 0.5
        ray = surface.rays(np.array([x]), np.array([surface.center_y_px]))[0]
        true_deg = math.degrees(math.atan2(ray[0], ray[2]))
        return abs(page.point('whole', 0.75 * width, 100) - true_deg) < CLOSE_DEG

    page.until(lambda: watcher.projection, 'the projection')
    page.until(shows_the_bearing, 'the bearing of the projection')
    page.press('c')

    def calibrated():
        answer = page.text('answer')
        if 'busy machine' in answer or 'nobody offers' in answer:
            page.press('c')  # the button does nothing while it asks
        return 'confidence' in answer

    page.until(calibrated, 'a calibration')
    page.press('s')

    def saved():
        if 'no picture' in page.text('answer'):
            # A loaded machine may take longer over a panorama than one may be old.
            page.press('s')
        return list(browser.downloads.glob('panorama_*.jpg'))

    picture = cv2.imread(str(page.until(saved, 'a snapshot')[0]))
    size = watcher.projection.height, watcher.projection.width
    # The calibration may move an edge between the two by a pixel.
    assert picture.shape[:2] == pytest.approx(size, abs=2)
    rig.stop('left/capture')
    page.until(lambda: 'Left camera: no sign of life' in page.text('problems'), 'the loss')
    rig.stop('right/capture')
    page.until(lambda: 'No picture for' in page.text('veil'), 'the end')
