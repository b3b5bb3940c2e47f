"""How pictures come to the viewer's page: as H.264 or JPEG, how late, and after a cut."""

import re
import socket
import threading
import time
from contextlib import closing, suppress
from itertools import cycle
from math import inf
from urllib.parse import urlsplit

import cv2
import numpy as np
import pytest
import viewer_page
from viewer_page import CLOSE_DEG, MAGENTA, SURFACES, Page, painted, patch

from fisheye_geometry.surface import Surface
from panorama_viewer.address import is_loopback, reachable
from panorama_viewer.settings import ViewerSettings
from panorama_viewer.tls import tls_of

serve, before_the_page = viewer_page.serve, viewer_page.before_the_page  # its fixtures


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
        window.opened = 0;
        window.WebSocket = class extends WebSocket {
          constructor(...words) {
            super(...words);
            opened += 1;
          }
        };
        VideoDecoder.prototype.decode = function decode(chunk) {
          decoded.push(chunk.type);
          if (decoded.length === 5) throw new Error('once');
          plain.call(this, chunk);
        };
    """)
    server = serve(SURFACES[0], painted(SURFACES[0], 31.0, 12.0))
    page = Page(browser, server.url)

    def decoded():
        opened, kinds = browser.execute_script('return [opened, decoded]')
        if opened > 1:  # after a pause the page connects anew, and begins with a keyframe
            browser.refresh()
        elif len(kinds) > 8:
            return kinds
        return None

    kinds = page.until(decoded, 'more pictures')
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


class PoorLink:
    """A way to a port that can become slow, or silent without a word to either end."""

    def __init__(self, port):
        self._target, self._is_cut = ('127.0.0.1', port), False
        self.bytes_per_s = inf
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
            while data := source.recv(4096):
                time.sleep(len(data) / self.bytes_per_s)
                if self._is_cut:
                    return
                target.sendall(data)
        if not self._is_cut:
            with suppress(OSError):  # also where the other end broke off
                target.shutdown(socket.SHUT_WR)


def test_the_page_comes_back_by_itself_when_its_link_was_silent(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), stale_after_s=1.0)
    with closing(PoorLink(urlsplit(server.url).port)) as relay:
        page = Page(browser, f'http://127.0.0.1:{relay.port}/')
        page.until(lambda: page.text('condition') == 'Live', 'a live picture')
        relay.cut()
        page.until(lambda: 'no connection' in page.text('veil'), 'the loss')
        relay.mend()
        page.until(lambda: page.text('condition') == 'Live', 'a live picture')
        page.until(lambda: page.text('format') == 'H.264', 'H.264')


def test_a_slow_link_shows_fewer_pictures(browser, serve, before_the_page):
    before_the_page(
        'delete window.VideoDecoder;'
        'const send = WebSocket.prototype.send;'
        'window.drawn = 0;'
        'WebSocket.prototype.send = function (word) {'
        '  window.drawn += word === "drawn";'
        '  send.call(this, word);'
        '};'
    )
    surface = SURFACES[0]
    noise = np.random.default_rng(1).integers(0, 255, (surface.height, surface.width, 3), np.uint8)
    server = serve(surface, noise)

    def drawn():
        server.tell(delay_ms=20 + time.monotonic() % 1)  # the viewer tells it twice a second
        return browser.execute_script('return window.drawn')

    with closing(PoorLink(urlsplit(server.url).port)) as relay:
        page = Page(browser, f'http://127.0.0.1:{relay.port}/')
        page.until(lambda: page.text('condition') == 'Live', 'a live picture')
        jpeg = cv2.imencode('.jpg', noise, (cv2.IMWRITE_JPEG_QUALITY, 95))[1]
        relay.bytes_per_s = len(jpeg) / 2.5  # the page takes silence of 1.5 s for a lost link
        before = drawn()
        page.until(lambda: drawn() > before + 2, 'pictures')


def test_the_delay_is_told_and_coloured(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0))
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    # The page adds the way to it, which a busy machine makes long: amber is found on the way up.
    for delays_ms, level in (
        ([-5000], ''),
        (range(-200, 300, 25), 'warning'),
        ([5000], 'error'),
        ([-5000], ''),
    ):
        told = cycle(delays_ms)

        def is_coloured(told=told, level=level):
            server.tell(delay_ms=next(told))
            return page.find('delay').get_attribute('data-level') == level

        page.until(is_coloured, f'{list(delays_ms)} ms as {level or "good"}')


def test_a_picture_that_stands_still_is_seen_to(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), stale_after_s=0.5)
    page = Page(browser, server.url)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.until(lambda: not page.find('veil').is_displayed(), 'no veil')
    server.fall_silent()
    page.until(lambda: page.find('veil').is_displayed(), 'a veil')
    # What says exactly 1 s stands there for a second only.
    age = re.compile(r'No picture for [1-9]\d* s')
    page.until(lambda: age.fullmatch(page.text('veil')), 'the age')
    server.stop()
    page.until(lambda: 'no connection' in page.text('veil'), 'the loss of the connection')
