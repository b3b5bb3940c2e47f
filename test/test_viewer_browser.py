"""The viewer's page in a real browser: headless Chromium, as packaged by Debian."""

import math
import re
import socket
import subprocess
import sys
import threading
from contextlib import closing, suppress
from pathlib import Path
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
import viewer_page
from known_rigs import synthetic_rig
from selenium.webdriver import Keys
from viewer_page import (
    CLOSED,
    GREEN,
    MAGENTA,
    SEAM,
    SPOT_DEG,
    SURFACES,
    Page,
    aside_deg,
    page_of,
    painted,
    patch,
)

from fisheye_bridge.projection import surface_of
from fisheye_geometry.surface import Surface
from fisheye_geometry.surface_kind import KINDS
from fisheye_testing.rig import camera_parameters
from panorama_viewer.address import is_loopback, reachable
from panorama_viewer.certificate import tls_of
from panorama_viewer.projection import described
from panorama_viewer.settings import ViewerSettings

serve = viewer_page.serve  # its fixture

ATTACK = Path(__file__).parents[1] / 'src/panorama_viewer/test/attack.py'
CLOSE_DEG = 1.0
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


@pytest.fixture
def attackers():
    """Return a function that attacks a port from another address until the test ends."""
    processes = []

    def run(kind, port):
        command = [sys.executable, ATTACK, kind, str(port), '127.0.0.2']
        process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        processes.append(process)
        process.stdout.readline()  # until all of them are there

    yield run
    for process in processes:
        process.kill()
        process.communicate()


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
    # The same picture, not closed, has ends.
    server.tell(projection=described(CLOSED[0]))
    page.press(Keys.ARROW_RIGHT * 45)
    page.until(lambda: page.bearing_deg == pytest.approx(180, abs=CLOSE_DEG), 'the right end')
    page.press(Keys.ARROW_LEFT * 45)
    page.until(lambda: page.bearing_deg == pytest.approx(-180, abs=CLOSE_DEG), 'the left end')


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


@pytest.fixture
def before_the_page(browser):
    """Return a function that has JavaScript run in every page before the page's own."""
    scripts = []

    def add(source):
        answer = browser.execute_cdp_cmd(
            'Page.addScriptToEvaluateOnNewDocument', {'source': source}
        )
        scripts.append(answer)

    yield add
    for script in scripts:
        browser.execute_cdp_cmd('Page.removeScriptToEvaluateOnNewDocument', script)


def format_of(page):
    """Return how pictures come, and what stands in the way of H.264."""
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    return page.text('format'), page.find('format').get_attribute('title')


@pytest.mark.parametrize('size', [(1300, 560), (1301, 561)], ids=['even', 'odd'])
def test_h264_shows_what_was_painted_where_it_is(browser, serve, size):
    surface = Surface('cylindrical', *size, 240.0, 640.0, 260.0)
    for bearing_deg in (-120.0, 0.0, 140.0):
        server = serve(surface, painted(surface, bearing_deg, 12.0))
        page = Page(browser, server.url)
        assert format_of(page) == ('H.264', '')
        shown_deg = page.point('whole', *patch(page, 'whole', MAGENTA).mean(axis=0))
        assert shown_deg == pytest.approx(bearing_deg, abs=CLOSE_DEG)


@pytest.mark.parametrize(
    ('script', 'reason'),
    [
        ('delete window.VideoDecoder', 'this browser has no WebCodecs'),
        (
            'VideoDecoder.isConfigSupported = async () => ({ supported: false })',
            'this browser does not decode H.264',
        ),
        (
            'VideoDecoder.prototype.decode = () => { throw new Error("worn out"); }',
            'this browser failed to decode H.264: worn out',
        ),
    ],
)
def test_a_browser_that_cannot_show_h264_shows_jpeg_and_says_why(
    browser, serve, before_the_page, script, reason
):
    before_the_page(script)
    server = serve(SURFACES[0], painted(SURFACES[0], 31.0, 12.0))
    page = Page(browser, server.url)
    page.until(lambda: page.text('format') == 'JPEG', 'JPEG')
    assert format_of(page) == ('JPEG', reason)
    page.find('format').click()
    page.until(lambda: page.text('answer') == reason, 'the reason in words')
    shown_deg = page.point('whole', *patch(page, 'whole', MAGENTA).mean(axis=0))
    assert shown_deg == pytest.approx(31.0, abs=CLOSE_DEG)


def test_a_picture_that_cannot_be_decoded_is_made_good_by_a_keyframe(
    browser, serve, before_the_page
):
    before_the_page("""
        const plain = VideoDecoder.prototype.decode;
        window.decoded = [];
        VideoDecoder.prototype.decode = function decode(chunk) {
          decoded.push(chunk.type);
          if (decoded.length === 5) throw new Error('once');
          plain.call(this, chunk);
        };
    """)
    server = serve(SURFACES[0], painted(SURFACES[0], 31.0, 12.0))
    page = Page(browser, server.url)
    page.until(lambda: len(browser.execute_script('return decoded')) > 8, 'more pictures')
    kinds = browser.execute_script('return decoded')
    assert kinds[:7] == ['key', 'delta', 'delta', 'delta', 'delta', 'key', 'delta']
    assert format_of(page) == ('H.264', '')


@pytest.mark.parametrize('is_encrypted', [False, True])
def test_other_machines_need_https_for_h264(browser, serve, is_encrypted, tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    tls = tls_of(ViewerSettings(https=is_encrypted), ())
    if is_loopback(reachable('0.0.0.0')):
        pytest.skip('this machine has no address but its own')
    server = serve(SURFACES[0], painted(SURFACES[0], 31.0, 12.0), tls=tls, host='0.0.0.0')
    page = Page(browser, server.url)
    expected = ('H.264', '') if is_encrypted else ('JPEG', 'this page was not opened by https')
    assert format_of(page) == expected


class SilentRelay:
    """A way to a port on which nothing comes through for a while, without a word to either end."""

    def __init__(self, port):
        self._target, self._is_cut = ('127.0.0.1', port), False
        self._listener = socket.create_server(('127.0.0.1', 0))
        self.port = self._listener.getsockname()[1]
        self._sockets = [self._listener]
        self._run(self._accept)

    def close(self):
        for each in self._sockets:
            with suppress(OSError):
                each.shutdown(socket.SHUT_RDWR)
            each.close()

    def cut(self):
        """Carry nothing from now on: neither what is open nor what comes."""
        self._is_cut = True

    def mend(self):
        """Carry what comes new."""
        self._is_cut = False

    def _run(self, work, *arguments):
        threading.Thread(target=work, args=arguments, daemon=True).start()

    def _accept(self):
        with suppress(OSError):
            while True:
                near, _ = self._listener.accept()
                self._sockets.append(near)
                if not self._is_cut:
                    far = socket.create_connection(self._target)
                    self._sockets.append(far)
                    self._run(self._carry, near, far)
                    self._run(self._carry, far, near)

    def _carry(self, source, target):
        with suppress(OSError):
            while data := source.recv(65536):
                if self._is_cut:
                    return
                target.sendall(data)
        if not self._is_cut:
            with suppress(OSError):  # also where the other end broke off
                target.shutdown(socket.SHUT_WR)


def test_the_page_comes_back_by_itself_when_its_link_was_silent(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    with closing(SilentRelay(urlsplit(server.url).port)) as relay:
        page = Page(browser, f'http://127.0.0.1:{relay.port}/')
        page.until(lambda: page.text('condition') == 'Live', 'a live picture')
        relay.cut()
        page.until(lambda: 'no connection' in page.text('veil'), 'the loss')
        relay.mend()
        page.until(lambda: page.text('condition') == 'Live', 'a live picture')
        assert page.text('format') == 'H.264'


def test_the_delay_is_told_and_coloured(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    for delay_ms, level in ((-5000, ''), (200, 'warning'), (5000, 'error'), (-5000, '')):
        server.tell(delay_ms=delay_ms)
        page.until(
            lambda level=level: page.find('delay').get_attribute('data-level') == level,
            f'{delay_ms} ms as {level or "good"}',
        )


def test_a_picture_that_stands_still_is_seen_to(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), stale_after_s=0.5)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    assert not page.find('veil').is_displayed()
    server.fall_silent()
    page.until(lambda: page.find('veil').is_displayed(), 'a veil')
    page.until(lambda: page.text('veil') == 'No picture for 1 s', 'the age')
    server.stop()
    page.until(lambda: 'no connection' in page.text('veil'), 'the loss of the connection')


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


def elsewhere(server):
    """Return the address of a page for other machines as this one reaches it, and the token."""
    url, _, token = server.url.partition('#token=')
    return f'http://127.0.0.1:{url.rpartition(":")[2]}', token


def test_the_page_asks_for_the_token_before_it_shows_anything(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0')
    url, token = elsewhere(server)
    page = Page(browser, url)
    for typed in ('guess', 'no (token) at all', token):
        page.until(lambda: page.find('token').is_displayed(), 'a question')
        assert 'looking needs the token' in page.text('veil')
        assert server.watchers == 0
        page.find('token').send_keys(typed, Keys.ENTER)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.press('c')
    page.until(lambda: 'measured anew' in page.text('answer'), 'a calibration')


def test_the_address_with_the_token_opens_the_page(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0')
    url, token = elsewhere(server)
    page = Page(browser, f'{url}#token={token}')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    assert token not in browser.current_url


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
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    server.tell(projection={**described(SURFACES[0]), 'surface': 'stereographic'})
    page.until(lambda: 'cannot show a stereographic panorama' in page.text('problems'), 'words')
    server.tell(projection=described(SURFACES[0]))
    page.until(lambda: not page.text('problems'), 'the end of it')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')


@pytest.mark.parametrize('kind', ['silent', 'idle', 'drawn'])
def test_the_page_stays_live_under_attack(browser, serve, attackers, kind):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0', public=True)
    server.tell(rate_hz=5.0)
    url, token = elsewhere(server)
    attackers(kind, int(url.rstrip('/').rpartition(':')[2]))
    page = Page(browser, f'{url}#token={token}')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    # Where this browser does not keep up, its own rate stands beside it.
    page.until(lambda: page.text('rate') == '5/s', 'the full rate')


def test_the_buttons_ask_for_the_token_where_everybody_can_look(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0', public=True)
    url, token = elsewhere(server)
    page = Page(browser, url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    for typed, answer in (('guess', 'needs the token'), (token, 'measured anew')):
        page.press('c')
        page.until(lambda: page.find('token').is_displayed(), 'a question')
        page.find('token').clear()
        page.find('token').send_keys(typed, Keys.ENTER)
        page.until(lambda answer=answer: answer in page.text('answer'), answer)


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
    surface = surface_of(page.until(lambda: watcher.projection, 'the projection'))
    width = page.find('whole').size['width']
    x = 0.75 * surface.width - 0.5
    ray = surface.rays(np.array([x]), np.array([surface.center_y_px]))[0]
    true_deg = math.degrees(math.atan2(ray[0], ray[2]))
    assert page.point('whole', 0.75 * width, 100) == pytest.approx(true_deg, abs=CLOSE_DEG)
    page.press('c')
    page.until(lambda: 'confidence' in page.text('answer'), 'a calibration')
    page.press('s')

    def saved():
        if 'no picture' in page.text('answer'):
            # A loaded machine may take longer over a panorama than one may be old.
            page.press('s')
        return list(browser.downloads.glob('panorama_*.jpg'))

    picture = cv2.imread(str(page.until(saved, 'a snapshot')[0]))
    assert picture.shape[:2] == (watcher.projection.height, watcher.projection.width)
    rig.stop('left/capture')
    page.until(lambda: 'Left camera: no sign of life' in page.text('problems'), 'the loss')
    rig.stop('right/capture')
    page.until(lambda: 'No picture for' in page.text('veil'), 'the end')
