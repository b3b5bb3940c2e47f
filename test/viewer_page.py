"""The viewer's page in a browser, as a person sees and uses it, and pictures to show on it."""

import math
import threading
from concurrent.futures import Future

import cv2
import numpy as np
import pytest
from selenium.webdriver import ActionChains, Keys

from fisheye_geometry.surface import Surface
from fisheye_testing.waiting import wait_for
from panorama_viewer.projection import described
from panorama_viewer.server import ViewerServer
from panorama_viewer.settings import ViewerSettings

DEADLINE_S = 60.0
SPOT_DEG = 1.5
CLOSE_DEG = 1.0
SURFACES = [
    Surface('cylindrical', 1300, 560, 240.0, 640.0, 260.0),
    Surface('equirectangular', 1300, 480, 240.0, 640.0, 240.0),
    Surface('rectilinear', 1200, 700, 420.0, 600.0, 330.0),
]
FOCAL_PX = 1200 / math.radians(270)
CLOSED = [
    Surface('cylindrical', 1508, 560, 1508 / math.tau, 753.5, 260.0),
    Surface('equirectangular', 1507, 480, 1507 / math.tau, 753.0, 240.0),
]
REAR = [
    Surface(kind, 1200, 560, FOCAL_PX, 599.5 - math.pi * FOCAL_PX, 260.0)
    for kind in ('cylindrical', 'equirectangular')
]
"""From 45 to 315 degrees."""
MAGENTA, GREEN = (255, 0, 255), (0, 255, 0)
SEAM = (216, 79, 255)
"""As the page marks it when one sets the rig up."""


class Page:
    """The page as a person sees and uses it."""

    def __init__(self, driver, url, width=900, height=560):
        size = {'width': width, 'height': height, 'deviceScaleFactor': 1, 'mobile': width < 500}
        driver.execute_cdp_cmd('Emulation.setDeviceMetricsOverride', size)
        driver.get(url)
        self.driver = driver

    def find(self, name):
        return self.driver.find_element('id', name)

    def text(self, name):
        return self.find(name).text

    def press(self, keys):
        ActionChains(self.driver).send_keys(keys).perform()

    def shot(self, name):
        """Return the pixels (height, width, 3) of an element."""
        coded = np.frombuffer(self.find(name).screenshot_as_png, np.uint8)
        return cv2.imdecode(coded, cv2.IMREAD_COLOR)

    def point(self, name, x, y):
        """Put the pointer on a place of an element and give the bearing and height shown."""
        size = self.find(name).size
        offset = round(x - size['width'] / 2), round(y - size['height'] / 2)
        ActionChains(self.driver, 0).move_to_element_with_offset(
            self.find(name), *offset
        ).perform()
        return float(self.find('bearing').get_attribute('data-bearing-deg'))

    @property
    def aids(self):
        """Names of the aids that are on."""
        return self.driver.execute_script('return document.body.dataset.aids').split()

    def click(self, name, x, y):
        """Press a place of an element."""
        self.point(name, x, y)
        ActionChains(self.driver, 0).click().perform()

    def mouse(self, kind, name, x, y, button='none', held=0):
        """Dispatch an event of the mouse at a place of an element; `held`: the buttons' bits."""
        at = self.find(name).rect
        self.driver.execute_cdp_cmd(
            'Input.dispatchMouseEvent',
            {
                'type': f'mouse{kind}',
                'x': at['x'] + x,
                'y': at['y'] + y,
                'button': button,
                'buttons': held,
                'clickCount': int(kind != 'Moved'),
            },
        )

    def leave(self):
        """Move the pointer off the picture."""
        ActionChains(self.driver, 0).move_to_element(self.find('condition')).perform()

    @property
    def bearing_deg(self):
        """Bearing of the middle of the view, or of what is under the pointer."""
        return float(self.find('bearing').get_attribute('data-bearing-deg') or 'nan')

    def look_at(self, bearing_deg):
        """Turn to the right by arrow keys until the view's middle is about there."""
        while abs(aside_deg(self.bearing_deg, bearing_deg)) > 3:
            self.turn()

    def turn(self):
        """Turn a step to the right; return by how much, deg."""
        before_deg = self.bearing_deg
        self.press(Keys.ARROW_RIGHT)
        self.until(lambda: self.bearing_deg != before_deg, 'a turn')
        return aside_deg(self.bearing_deg, before_deg)

    def until(self, condition, what):
        return wait_for(condition, DEADLINE_S, what)


@pytest.fixture
def serve():
    """Return a function that shows one picture over and over, until `stop` is called.

    None becomes stale unless a test asks for it: a busy machine may pause for more than a second,
    and a page whose picture is dead is grey.
    """
    ended, faults = [], []

    def start(surface, image, wraps=False, tls=None, orientation=None, **settings):
        measured = Future()
        measured.set_result('measured anew')
        server = ViewerServer(
            ViewerSettings(**{'port': 0, 'stale_after_s': 60.0, **settings}),
            calibrate=lambda: measured,
            watched=lambda: None,
            report=lambda sentence, trace: faults.append(trace),
            tls=tls,
        )
        server.start()
        projection = described(surface, wraps)
        server.tell(projection=projection, rate_hz=10.0, delay_ms=20, problems=[])
        jpeg = cv2.imencode('.jpg', image, (cv2.IMWRITE_JPEG_QUALITY, 95))[1].tobytes()
        silent = threading.Event()

        def feed():
            while not silent.wait(0.2):
                server.show(jpeg, orientation)

        thread = threading.Thread(target=feed)
        thread.start()

        def fall_silent():
            silent.set()
            thread.join()

        server.fall_silent = fall_silent
        ended.extend([fall_silent, server.stop])
        return server

    yield start
    for end in ended:
        end()
    assert not faults


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


def page_of(rig, browser, **size):
    """Start the viewer beside a rig and open its page."""
    rig.start('viewer', port=0)
    return Page(browser, rig.page_url(DEADLINE_S), **size)


def aside_deg(bearing_deg, other_deg):
    """Return how far right of another bearing one is, the short way round."""
    return (bearing_deg - other_deg + 180) % 360 - 180


def painted(surface, bearing_deg, height_deg):
    """Paint a panorama of a spot in a direction and of a straight bar that stands before us."""
    y, x = np.mgrid[: surface.height, : surface.width]
    rays = surface.rays(x.astype(float), y.astype(float))
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    bearing, height = np.radians((bearing_deg, height_deg))
    spot = (
        np.cos(height) * np.sin(bearing),
        -np.sin(height),
        np.cos(height) * np.cos(bearing),
    )
    image = np.full((surface.height, surface.width, 3), 90, np.uint8)
    ahead = rays[..., 2] > 0.3
    with np.errstate(divide='ignore', invalid='ignore'):
        across, up = rays[..., 0] / rays[..., 2], -rays[..., 1] / rays[..., 2]
    image[ahead & (abs(up - 0.35 - 0.1 * across) < 0.006) & (abs(across) < 0.7)] = GREEN
    image[rays @ spot > math.cos(math.radians(SPOT_DEG))] = MAGENTA
    return image


def where(shot, color):
    """Pixels (n, 2) as x, y of the largest patch of a colour."""
    near = (abs(shot.astype(int) - color).max(axis=2) < 90).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(near, connectivity=8)
    if len(stats) < 2:
        return np.zeros((0, 2))
    return np.argwhere(labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax())[:, ::-1]


def patch(page, name, color):
    """Wait until an element shows a patch of a colour and give its pixels (n, 2)."""
    found = np.zeros((0, 2))

    def look():
        nonlocal found
        found = where(page.shot(name), color)
        return len(found) > 9

    page.until(look, f'{color} in {name}')
    return found
