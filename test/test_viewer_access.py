"""Who may look at the viewer's page and press its buttons, in a browser, also under attack."""

import subprocess
import sys
from pathlib import Path

import pytest
import viewer_page
from selenium.webdriver import Keys
from viewer_page import SURFACES, Page, painted

serve, before_the_page = viewer_page.serve, viewer_page.before_the_page  # its fixtures

ATTACK = Path(__file__).parents[1] / 'src/panorama_viewer/test/attack.py'


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


@pytest.mark.parametrize('copied_with_it', ['', ')'])
def test_the_address_with_the_token_opens_the_page(browser, serve, copied_with_it):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0')
    url, token = elsewhere(server)
    page = Page(browser, f'{url}#token={token}{copied_with_it}')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    assert token not in browser.current_url


def test_a_browser_that_keeps_nothing_for_sites_looks_all_the_same(
    browser, serve, before_the_page
):
    before_the_page("""
      for (const name of ['localStorage', 'sessionStorage']) {
        const get = () => { throw new DOMException('blocked', 'SecurityError'); };
        Object.defineProperty(window, name, { get });
      }
    """)
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), host='0.0.0.0')
    url, token = elsewhere(server)
    page = Page(browser, f'{url}#token={token}')
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    page.press('d')
    assert 'edges' in page.aids


@pytest.mark.parametrize('kind', ['silent', 'idle', 'drawn'])
def test_the_page_stays_live_under_attack(browser, serve, attackers, kind):
    image = painted(SURFACES[0], 0, 0)
    server = serve(SURFACES[0], image, stale_after_s=1.0, host='0.0.0.0', public=True)
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
