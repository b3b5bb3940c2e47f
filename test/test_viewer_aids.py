"""The aids for a driver on the viewer's page, in a real browser."""

import math

import numpy as np
import pytest
import viewer_page
from selenium.webdriver import Keys
from viewer_page import CLOSED, MAGENTA, REAR, SEAM, SURFACES, Page, painted, patch

from fisheye_geometry.attitude import Attitude, quaternion
from fisheye_geometry.surface import Surface

serve = viewer_page.serve  # its fixture

HEADING, GROUND, CAMERA = (132, 220, 61), (77, 216, 255), (255, 200, 94)
"""Blue, green and red of the marks."""
NEAR = 90
"""Levels by which a thin line differs from its colour between two rows of pixels."""
CLOSE_PX = 3.0
"""Half of a line with its edges, and a pixel."""
MINUS = '\N{MINUS SIGN}'
FAR_M = 10.0
MARKS_M = (1.0, 2.0, 5.0, FAR_M)
WIDTH_M, HEIGHT_M = 1.2, 0.9
REAR_FOV_DEG = 110.0
KEYS = {'heading': 'h', 'ground': 'g', 'rear': 'r', 'edges': 'd', 'setup': 'm', 'sunlight': 'l'}
ASIDE = [
    Surface('cylindrical', 1300, 560, 240.0, 560.0, 220.0),
    Surface('equirectangular', 1300, 480, 240.0, 700.0, 200.0),
    Surface('rectilinear', 1200, 700, 420.0, 500.0, 250.0),
]
"""With bearing 0 and the horizon beside the middle."""


def grey(surface):
    return np.full((surface.height, surface.width, 3), 90, np.uint8)


def page_with(browser, server, *aids, **size):
    """Open the page and switch aids on, and none besides."""
    page = Page(browser, server.url, **size)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')
    for aid in {*aids} ^ set(page.aids):
        page.press(KEYS[aid])
    assert set(page.aids) == {*aids}
    return page


def close_to(shot, color, near=50):
    """Pixels (n, 2) as x, y that have a colour."""
    return np.argwhere(abs(shot.astype(int) - color).max(axis=2) < near)[:, ::-1].astype(float)


def frames(page, count=5):
    """Wait until the screen was drawn anew a few times."""
    page.driver.execute_async_script(
        """
        const [count, done] = arguments;
        const next = (left) => (left ? requestAnimationFrame(() => next(left - 1)) : done());
        next(count);
        """,
        count,
    )


def in_view(page, rays):
    """Place rays on the view without distortion that the page shows, px; its pitch is 0."""
    size = page.find('look').size
    focal_px = max(size['width'], size['height']) / 2 / math.tan(math.pi / 4)
    yaw = math.radians(page.bearing_deg)
    x = rays[:, 0] * math.cos(yaw) - rays[:, 2] * math.sin(yaw)
    z = rays[:, 0] * math.sin(yaw) + rays[:, 2] * math.cos(yaw)
    ahead = z > 0.05
    places = np.stack([x, rays[:, 1]], axis=-1)[ahead] / z[ahead, None] * focal_px
    return places + np.array([size['width'], size['height']]) / 2


def in_whole(page, surface, rays):
    """Place rays on the whole panorama that the page shows, px."""
    pixels, seen = surface.project(rays)
    return (pixels[seen] + 0.5) * (page.find('whole').size['width'] / surface.width)


@pytest.mark.parametrize('surface', ASIDE, ids=lambda surface: surface.kind)
def test_the_mark_ahead_stands_at_bearing_0(browser, serve, surface):
    page = page_with(browser, serve(surface, grey(surface)), 'heading')
    true_px = (surface.center_x_px + 0.5) * page.find('whole').size['width'] / surface.width
    assert patch(page, 'scale', HEADING)[:, 0].mean() == pytest.approx(true_px, abs=1)
    page.find('toggle').click()
    page.press(Keys.ARROW_RIGHT * 2)
    page.until(lambda: page.bearing_deg == pytest.approx(18, abs=0.1), 'a turn')
    ((true_px, _),) = in_view(page, np.array([[0.0, 0.0, 1.0]]))
    assert patch(page, 'scale', HEADING)[:, 0].mean() == pytest.approx(true_px, abs=1)


@pytest.mark.parametrize(('key', 'side'), [(Keys.ARROW_RIGHT, 0), (Keys.ARROW_LEFT, 1)])
def test_out_of_sight_the_tape_shows_which_way_to_turn(browser, serve, key, side):
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])), 'heading')
    page.press('v' + key * 8)
    page.until(lambda: abs(page.bearing_deg) == pytest.approx(72, abs=0.1), 'a turn')
    frames(page)
    marks_px = close_to(page.shot('scale'), HEADING)[:, 0]
    assert len(marks_px) > 20
    assert abs(marks_px - side * page.find('scale').size['width']).max() < 60, 'at that edge'


def test_the_tape_shows_how_wide_the_robot_is(browser, serve):
    server = serve(SURFACES[0], grey(SURFACES[0]))
    server.tell(robot_width_m=WIDTH_M)
    page = page_with(browser, server, 'heading')
    half_deg = math.degrees(math.atan(WIDTH_M / 2 / 2.0))
    scale = page.find('whole').size['width'] / SURFACES[0].width
    true_px = 2 * math.radians(half_deg) * SURFACES[0].focal_px * scale

    def width():
        drawn_px = close_to(page.shot('scale'), HEADING)[:, 0]
        return np.ptp(drawn_px) + 1 == pytest.approx(true_px, abs=2)

    page.until(width, 'a bar as wide as the robot two metres ahead')


def path_left():
    """Rays (n, 3) of the left side of the robot's path and of the left half of its marks."""
    bearings = np.linspace(math.atan2(WIDTH_M / 2, FAR_M), math.pi / 2, 3000)
    side = [(-WIDTH_M / 2, HEIGHT_M, WIDTH_M / 2 / math.tan(bearing)) for bearing in bearings]
    across = [(x, HEIGHT_M, z) for z in MARKS_M for x in np.linspace(-WIDTH_M / 2, 0, 500)]
    return np.array(side + across)


@pytest.mark.parametrize('surface', ASIDE, ids=lambda surface: surface.kind)
def test_the_path_lies_on_the_ground_as_wide_as_the_robot(browser, serve, surface):
    server = serve(surface, grey(surface))
    server.tell(robot_width_m=WIDTH_M, camera_height_m=HEIGHT_M)
    page = page_with(browser, server, 'ground')
    patch(page, 'whole', GROUND)
    check_path(page.shot('whole'), lambda rays: in_whole(page, surface, rays))
    page.press('v' + Keys.ARROW_RIGHT)
    page.until(lambda: page.bearing_deg == pytest.approx(9, abs=0.1), 'a turn')
    frames(page)
    check_path(page.shot('look'), lambda rays: in_view(page, rays))


def check_path(shot, placed):
    """Compare the left half of the path with where geometry has it."""
    middle_px = placed(np.array([[0.0, 0.0, 1.0]]))[0, 0]
    drawn = close_to(shot, GROUND, NEAR)
    drawn = drawn[drawn[:, 0] < middle_px - CLOSE_PX] + 0.5
    true = placed(path_left())
    beyond = np.maximum(-true, true - shot.shape[1::-1]).max(axis=1)
    apart = np.linalg.norm(drawn[:, None] - true[None], axis=-1)
    assert apart[:, beyond < CLOSE_PX].min(axis=1).max() < CLOSE_PX, 'nothing is drawn elsewhere'
    inside = (beyond < -1) & (true[:, 0] < middle_px - 2 * CLOSE_PX)
    assert np.ptp(true[inside, 1]) > 80
    assert apart[:, inside].min(axis=0).max() < CLOSE_PX, 'all of it is drawn'
    ((_, end_px),) = placed(np.array([[-WIDTH_M / 2, HEIGHT_M, FAR_M]]))
    assert drawn[:, 1].min() == pytest.approx(end_px, abs=CLOSE_PX), 'it ends 10 m ahead'


def test_a_path_of_which_too_little_is_known_is_not_drawn_but_said(browser, serve):
    server = serve(SURFACES[0], grey(SURFACES[0]))
    server.tell(robot_width_m=WIDTH_M, camera_height_m=0.0)
    page = page_with(browser, server)
    page.press('g')
    page.until(lambda: 'set robot_width_m and camera_height_m' in page.text('answer'), 'words')
    assert not len(close_to(page.shot('whole'), GROUND))
    server.tell(camera_height_m=HEIGHT_M)
    page.until(lambda: len(close_to(page.shot('whole'), GROUND)), 'the path')


@pytest.mark.parametrize('aside_deg', [-20.0, 0.0])
def test_the_inset_shows_what_is_behind_as_a_mirror_does(browser, serve, aside_deg):
    # What is to the left of the robot is to the left in a mirror.
    bearing_deg = -180 - aside_deg
    server = serve(CLOSED[0], painted(CLOSED[0], bearing_deg, 0), wraps=True, stale_after_s=0.5)
    page = page_with(browser, server, 'rear', width=1280, height=720)
    spot_px = patch(page, 'rear', MAGENTA)[:, 0].mean() + 0.5
    canvas = page.driver.find_element('css selector', '#rear canvas').size
    focal_px = canvas['width'] / 2 / math.tan(math.radians(REAR_FOV_DEG / 2))
    right_px = spot_px - page.find('rear').size['width'] / 2
    assert math.degrees(math.atan(right_px / focal_px)) == pytest.approx(aside_deg, abs=1)
    server.fall_silent()
    page.until(lambda: not len(close_to(page.shot('rear'), MAGENTA)), 'a dead inset to turn grey')


@pytest.mark.parametrize('surface', ASIDE, ids=lambda surface: surface.kind)
def test_the_edges_have_their_degrees(browser, serve, surface):
    page = page_with(browser, serve(surface, grey(surface)), 'edges')
    corners = np.array([[-0.5, surface.center_y_px], [surface.width - 0.5, surface.center_y_px]])
    rays, _ = surface.unproject(corners)
    true = [f'{math.degrees(math.atan2(x, z)):.0f}°'.replace('-', MINUS) for x, _, z in rays]
    page.until(lambda: [page.text('left-edge'), page.text('right-edge')] == true, f'{true}')
    page.press('v' + Keys.ARROW_LEFT)
    page.until(lambda: page.text('left-edge') == f'{MINUS}54°', 'the left edge of the view')
    assert page.text('right-edge') == '36°'
    page.press('d')
    assert not page.find('left-edge').is_displayed()


def joined(left, right, seam, right_begin_px, left_end_px):
    columns = {'seam_begin_px': seam[0], 'seam_end_px': seam[1]}
    columns.update(right_begin_px=right_begin_px, left_end_px=left_end_px)
    return {'left': left, 'right': right, 'found': True, 'confidence': 0.9, 'words': '', **columns}


@pytest.mark.parametrize('surface', ASIDE, ids=lambda surface: surface.kind)
def test_the_seam_and_the_fields_are_marked_at_their_columns(browser, serve, surface):
    server = serve(surface, grey(surface))
    server.tell(overlaps=[joined('left', 'right', (500, 520), 430, 610)])
    page = page_with(browser, server, 'setup')
    scale = page.find('whole').size['width'] / surface.width
    seam_px = patch(page, 'whole', SEAM)[:, 0] + 0.5
    assert seam_px.mean() == pytest.approx(510 * scale, abs=1)
    field_px = close_to(page.shot('whole')[:60], CAMERA)[:, 0] + 0.5
    assert [field_px.min(), field_px.max()] == pytest.approx([0, 610 * scale], abs=2)
    page.find('toggle').click()
    frames(page)
    page.press(Keys.ARROW_LEFT * 2)
    page.until(lambda: page.bearing_deg == pytest.approx(-18, abs=0.1), 'a turn')
    ray = surface.rays(np.array([509.5]), np.array([surface.center_y_px]))
    row = page.find('look').size['height'] // 2
    seam = close_to(page.shot('look'), SEAM)
    ((true_px, _),) = in_view(page, ray)
    assert np.median(seam[seam[:, 1] == row, 0] + 0.5) == pytest.approx(true_px, abs=1.5)


@pytest.mark.parametrize('surface', [SURFACES[0], REAR[0]], ids=['ahead', 'behind'])
def test_the_seam_is_marked_where_it_is_in_a_picture_that_was_levelled(browser, serve, surface):
    nod = Attitude(*np.radians((0.0, 6.0, -4.0)))
    server = serve(surface, grey(surface), orientation=quaternion(nod))
    server.tell(overlaps=[joined('left', 'right', (300, 300), 250, 350)])
    page = page_with(browser, server, 'setup')
    frames(page)
    down = np.linspace(0, surface.height, 4000) - 0.5
    true_px = in_whole(page, surface, surface.rays(299.5, down) @ nod.matrix.T)
    drawn_px = close_to(page.shot('whole'), SEAM) + 0.5
    apart = np.linalg.norm(drawn_px[:, None] - true_px[None], axis=-1)
    assert len(drawn_px) > 200
    assert apart.min(axis=1).max() < CLOSE_PX


def test_a_seam_beyond_the_edge_of_a_ring_is_marked_where_it_comes_in(browser, serve):
    surface = CLOSED[0]
    server = serve(surface, grey(surface), wraps=True)
    server.tell(
        overlaps=[
            joined('left', 'right', (700, 710), 600, 800),
            joined('right', 'left', (surface.width + 80, surface.width + 90), -60, 1700),
        ]
    )
    page = page_with(browser, server, 'setup')
    scale = page.find('whole').size['width'] / surface.width
    frames(page)
    seams_px = close_to(page.shot('whole'), SEAM)[:, 0] + 0.5
    halves = seams_px[seams_px < 400 * scale], seams_px[seams_px > 400 * scale]
    assert [np.median(half) for half in halves] == pytest.approx([85 * scale, 705 * scale], abs=1)


def test_keys_switch_the_aids_and_the_page_remembers(browser, serve):
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])), 'heading')
    for aid in KEYS:
        was_on = aid in page.aids
        page.press(KEYS[aid])
        assert (aid in page.aids) is not was_on
    after = page.aids
    assert set(after) == {*KEYS} - {'heading'}
    page.driver.refresh()
    assert page.aids == after
    for aid in after:
        page.press(KEYS[aid])
    page.driver.refresh()
    assert page.aids == []
    page.driver.execute_script("localStorage.setItem('aids', 'no such aid')")
    page.driver.refresh()
    page.press('r')
    assert 'rear' in page.aids, 'whatever is remembered'


def test_an_aid_that_fails_is_switched_off_and_the_picture_goes_on(browser, serve):
    server = serve(SURFACES[0], painted(SURFACES[0], 0, 0), stale_after_s=1.0)
    page = page_with(browser, server, 'edges')
    script = "document.querySelector('#rear canvas').getContext = () => null"
    page.driver.execute_script(script)
    page.press('r')
    page.until(lambda: 'Rear view is switched off' in page.text('answer'), 'words')
    assert page.aids == ['edges']
    page.press('v')
    patch(page, 'look', MAGENTA)
    page.until(lambda: page.text('condition') == 'Live', 'a live picture')


def test_a_finger_reaches_every_aid(browser, serve):
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])), width=390, height=844)
    assert not page.find('aids').is_displayed()
    page.find('help').click()
    buttons = page.find('aids').find_elements('css selector', 'button')
    assert len(buttons) == len(KEYS)
    for button in buttons:
        button.click()
        assert button.get_attribute('aria-pressed') == 'true'
    assert set(page.aids) == {*KEYS}
    width = browser.execute_script('return document.documentElement.scrollWidth')
    assert width == 390, 'nothing sticks out'


@pytest.mark.parametrize('size', [(1280, 720), (390, 844)], ids=['desk', 'phone'])
@pytest.mark.parametrize('mode', ['whole', 'look'])
def test_nothing_that_an_aid_adds_lies_over_the_picture(browser, serve, mode, size):
    server = serve(SURFACES[0], grey(SURFACES[0]))
    page = page_with(browser, server, *KEYS, width=size[0], height=size[1])
    if browser.execute_script('return document.body.dataset.mode') != mode:
        page.press('v')
    page.press('a')
    page.until(lambda: page.find('aids').is_displayed(), 'the row of aids')

    def beside():
        picture = page.find(mode).rect
        places = [page.find(name).rect for name in ('aids', 'rear', 'scale')]
        assert min(place['height'] for place in (picture, *places)) > 20
        return all(
            place['y'] + place['height'] <= picture['y'] + 1
            or place['y'] + 1 >= picture['y'] + picture['height']
            for place in places
        )

    page.until(beside, 'room for everything')


def test_in_sunlight_text_is_larger(browser, serve):
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])))
    before = page.find('rate').size['height'], page.find('bearing').size['height']
    page.press('l')
    after = page.find('rate').size['height'], page.find('bearing').size['height']
    assert min(np.divide(after, before)) > 1.25
    assert page.find('condition').value_of_css_property('color') == 'rgba(0, 0, 0, 1)'


PAD = """
  window.pad = { mapping: arguments[0], connected: true, axes: [0, 0, 0, 0],
    buttons: Array.from({ length: 17 }, () => ({ pressed: false })) };
  navigator.getGamepads = () => [null, window.pad];
  window.dispatchEvent(new Event('gamepadconnected'));
"""


def test_the_right_stick_looks_around_and_its_button_returns(browser, serve):
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])))
    script = page.driver.execute_script
    before_deg = page.bearing_deg
    script(PAD, 'standard')
    script('window.pad.axes = [1, 1, 0.1, -0.1]')
    frames(page)
    assert page.bearing_deg == before_deg, 'the left stick and a drift do nothing'
    script('window.pad.axes = [0, 0, 1, 0]')
    page.until(lambda: page.bearing_deg > 20, 'a turn to the right')
    script('window.pad.axes = [0, 0, 0, -1]')
    page.until(lambda: page.text('bearing').endswith('up'), 'a look up')
    script('window.pad.axes = [0, 0, 0, 0]')
    frames(page)
    held_deg = page.bearing_deg
    frames(page)
    assert page.bearing_deg == held_deg
    script('window.pad.buttons[11].pressed = true')
    page.until(lambda: page.text('bearing') == '0.0° · 0.0°', 'the view straight ahead')


def test_a_gamepad_of_an_unknown_mapping_turns_nothing(browser, serve):
    # What is the right stick elsewhere may be a trigger here, which rests at -1.
    page = page_with(browser, serve(SURFACES[0], grey(SURFACES[0])))
    page.press('v')
    page.driver.execute_script(PAD + 'window.pad.axes = [0, 0, -1, -1];', '')
    frames(page)
    assert page.bearing_deg == 0.0
    page.driver.execute_script(PAD + 'window.pad.axes = [0, 0, -1, 0];', 'standard')
    page.until(lambda: page.bearing_deg < -10, 'a turn to the left by one that is known')
