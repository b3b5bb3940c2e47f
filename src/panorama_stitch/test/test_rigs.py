"""Panoramas of rigs of every kind, against the scene drawn directly on their surface."""

import json
from itertools import pairwise

import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.lens import AnnularLens, make_lens
from fisheye_geometry.lens_surface import surface_for
from fisheye_geometry.level import levelled
from fisheye_geometry.remap import RemapTable
from fisheye_geometry.rig import chain
from fisheye_geometry.rig_solution import solve_rig
from fisheye_testing.data import real_data
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.build import Style, build_compositor
from panorama_stitch.compose.layout import covered
from panorama_stitch.compose.placing import leads_around, place
from panorama_stitch.compose.posing import views_of_rig
from panorama_stitch.compose.view import View
from panorama_stitch.pipeline.stale import write_age

FAITHFUL_DB = 40.0
"""A bilinear resampling of an antialiased scene stays above it, and one camera of four that is off
by half a degree does not."""
COARSE_DB = 32.0
"""The inner edge of a mirror's ring has half the resolution."""
SEAMLESS = 1.5
"""How much more the columns beside the edge of a closed panorama may differ than others do."""
CLOSE_DEG = 0.5
"""A pixel of these panoramas and a half."""
STAMP_NS = 700_000_000
FISHEYE = synthetic_lens(320, 240, np.radians(170))
WIDE = synthetic_lens(400, 400, np.radians(200)).with_max_angle(np.radians(100))
SMALL = synthetic_lens(240, 180, np.radians(160))
PLAIN = make_lens('plumb_bob', 240, 180, [148.2, 0, 119.5, 0, 148.2, 89.5, 0, 0, 1], [])
"""78 degrees across."""
MIRROR = AnnularLens(480, 480, 235, 235, 239.5, 239.5, (0.5, *np.radians([-35, 20]), -1.0))

RIGS = {
    'level pair': ([(-70, 0, 0), (70, 0, 0)], FISHEYE, False),
    'looking down': ([(-70, -15, 0), (70, -15, 0)], FISHEYE, False),
    'not alike': ([(-70, -4, 3), (70, -8, -5)], FISHEYE, False),
    'upside down': ([(-70, 0, 180), (70, 0, 180)], FISHEYE, False),
    'one upside down': ([(-70, 0, 0), (70, 2, 180)], FISHEYE, False),
    'on their side': ([(-55, 0, 90), (55, 0, -90)], FISHEYE, False),
    'one camera': ([(0, -5, 3)], FISHEYE, False),
    'back to back': ([(-90, 0, 0), (90, 1.5, -1)], WIDE, True),
    'a ring of three': ([(-120, -3, 0), (0, -3, 0), (120, -3, 0)], FISHEYE, True),
    'a ring of four': ([(-135, -6, 1), (-45, -8, -2), (45, -5, 2), (135, -7, 0)], FISHEYE, True),
    'a turned ring': ([(100, 0, 0), (190, 0, 0), (280, 0, 0), (10, 0, 0)], FISHEYE, True),
    'six conventional': ([(yaw, 0, 0) for yaw in range(-150, 180, 60)], PLAIN, True),
    'eight': ([(yaw, -5, 0) for yaw in range(-160, 180, 45)], SMALL, True),
    'a mirror': ([(0, 0, 0)], MIRROR, True),
    'a leaning mirror': ([(30, 4, -3)], MIRROR, True),
    'looking straight up': ([(20, 90, 0)], WIDE, True),
    'looking straight down': ([(0, -90, 0)], WIDE, True),
    'three wide': ([(-95, -2, 0), (0, -2, 0), (95, -2, 0)], FISHEYE, False),
}


def rig(name, kind='cylindrical'):
    angles, lens, wraps = RIGS[name]
    attitudes = [Attitude(*np.radians(each)) for each in angles]
    views = [View(lens, surface_for(lens, kind), attitude=attitude) for attitude in attitudes]
    images = [Scene().view(lens, attitude).frame(STAMP_NS) for attitude in attitudes]
    return views, images, wraps


def composed(views, images, wraps, style):
    compositor = build_compositor(views, images, style, wraps=wraps)
    surface = compositor.layout.surface
    out = np.full((surface.height, surface.width, 3), 77, np.uint8)
    compositor.compose(images, out)
    return compositor.layout, out


def psnr(a, b, where=np.s_[:]):
    return 10 * np.log10(255**2 / np.mean((a.astype(float) - b)[where] ** 2))


@pytest.mark.parametrize('name', RIGS)
def test_it_shows_the_scene_and_leaves_no_black(name):
    layout, out = composed(*rig(name), Style())
    limit_db = COARSE_DB if 'mirror' in name else FAITHFUL_DB
    assert psnr(out, Scene().view(layout.surface).frame(STAMP_NS)) > limit_db
    assert out.any(axis=2).all()


@pytest.mark.parametrize('blend', ['none', 'multiband'])
@pytest.mark.parametrize('name', ['looking down', 'back to back', 'a ring of four'])
def test_so_it_does_with_every_blend(name, blend):
    layout, out = composed(*rig(name), Style(blend=blend))
    assert psnr(out, Scene().view(layout.surface).frame(STAMP_NS)) > FAITHFUL_DB


@pytest.mark.parametrize('name', ['not alike', 'a ring of four'])
def test_an_equirectangular_one_too(name):
    layout, out = composed(*rig(name, 'equirectangular'), Style())
    assert psnr(out, Scene().view(layout.surface).frame(STAMP_NS)) > FAITHFUL_DB


@pytest.mark.parametrize('name', ['looking down', 'on their side', 'a ring of four'])
def test_uncropped_it_is_black_where_no_camera_that_owns_the_columns_sees(name):
    views, images, wraps = rig(name)
    layout, out = composed(views, images, wraps, Style(crop='none'))
    shown = covered(layout, place(views, wraps=wraps))
    truth = Scene().view(layout.surface).frame(STAMP_NS)
    assert psnr(out, truth, shown) > FAITHFUL_DB
    assert (out[~shown] == 0).all()


@pytest.mark.parametrize('name', [name for name, (*_, wraps) in RIGS.items() if wraps])
def test_a_closed_panorama_leads_all_around_and_nobody_sees_its_edge(name):
    layout, out = composed(*rig(name), Style())
    assert layout.surface.width == pytest.approx(2 * np.pi * layout.surface.focal_px)
    steps = np.abs(np.diff(out.astype(float), axis=1, append=out[:, :1])).mean(axis=(0, 2))
    assert steps[-1] <= SEAMLESS * np.quantile(steps, 0.9)


@pytest.mark.parametrize(
    ('name', 'fov_deg'), [('a turned ring', 170), ('six conventional', 78), ('level pair', 170)]
)
def test_the_layout_knows_how_far_each_camera_sees(name, fov_deg):
    layout, _ = composed(*rig(name), Style())
    surface = layout.surface
    edges_px = np.array([(0, surface.width), *layout.fields]) - 0.5 - surface.center_x_px
    ends_deg, *fields_deg = np.degrees(edges_px / surface.focal_px)
    for (yaw_deg, *_), edges_deg in zip(RIGS[name][0], fields_deg, strict=True):
        true_deg = [yaw_deg - fov_deg / 2, yaw_deg + fov_deg / 2]
        if not layout.wraps:
            true_deg = np.clip(true_deg, *ends_deg)
        off_deg = (np.subtract(edges_deg, true_deg) + 180) % 360 - 180
        assert off_deg == pytest.approx([0, 0], abs=CLOSE_DEG)


@pytest.mark.parametrize('name', ['a turned ring', 'level pair', 'three wide', 'upside down'])
def test_the_seam_of_two_neighbours_lies_where_both_see(name):
    layout, _ = composed(*rig(name), Style())
    count, width = len(layout.fields), layout.surface.width
    for index in range(count if layout.wraps else count - 1):
        left, right = index, (index + 1) % count
        seam = layout.seam(left, right)
        assert seam == layout.seam(right, left)
        middle = sum(seam) / 2
        for begin, end in (layout.fields[left], layout.fields[right]):
            assert any(begin < middle + aside < end for aside in (-width, 0, width))
    if count > 2:
        assert layout.seam(0, 2 if layout.wraps else count - 1) is None


def test_no_bearing_is_shown_twice_where_two_wide_lenses_stay_open():
    views, images, _ = rig('back to back')
    layout, _ = composed(views, images, False, Style())
    assert layout.surface.width <= 2 * np.pi * layout.surface.focal_px


@pytest.mark.parametrize('name', RIGS)
def test_what_the_cameras_see_tells_whether_they_stand_all_around(name):
    views, _, wraps = rig(name)
    assert leads_around(views) == wraps


def test_cameras_that_overlap_in_front_do_not_stand_all_around():
    views = [
        View(FISHEYE, surface_for(FISHEYE), attitude=Attitude(np.radians(yaw)))
        for yaw in (-70, 0, 70)
    ]
    assert not leads_around(views)


def test_a_rig_of_which_nothing_is_known_stands_side_by_side():
    surface, image = surface_for(FISHEYE), Scene().view(FISHEYE).frame(STAMP_NS)
    solution = solve_rig([(name, FISHEYE) for name in 'abc'], [None, None])
    views = views_of_rig(solution.rig, [surface] * 3)
    layout, out = composed(views, [image] * 3, False, Style(blend='none', crop='none'))
    alone = View(FISHEYE, surface).corrected(image)
    assert layout.surface.width == 3 * surface.width
    assert np.abs(out.astype(int) - np.hstack([alone] * 3)).max() <= 1, 'black and seen is 1 alone'


def test_lenses_and_sizes_may_differ():
    cameras = [(FISHEYE, (-70, -5, 0)), (WIDE, (20, -5, 0)), (PLAIN, (100, -5, 0))]
    views, images = [], []
    for lens, angles in cameras:
        attitude = Attitude(*np.radians(angles))
        views.append(View(lens, surface_for(lens), attitude=attitude))
        images.append(Scene().view(lens, attitude).frame(STAMP_NS))
    layout, out = composed(views, images, False, Style())
    truth = Scene().view(layout.surface).frame(STAMP_NS)
    assert psnr(out, truth) > COARSE_DB
    assert len(layout.seams) == 2


def test_a_camera_that_others_cover_has_no_columns():
    lenses = FISHEYE, synthetic_lens(320, 240, np.radians(60)), FISHEYE
    views, images = [], []
    for lens, yaw_deg in zip(lenses, (-45, 0, 45), strict=True):
        attitude = Attitude(np.radians(yaw_deg))
        views.append(View(lens, surface_for(lens), attitude=attitude))
        images.append(Scene().view(lens, attitude).frame(STAMP_NS))
    layout, out = composed(views, images, False, Style(blend='none'))
    columns = layout.shown_columns(1)
    assert columns[0] == columns[1]
    before = out.copy()
    write_age(out, columns, 'front', 3.0)
    assert (out == before).all()


def test_corrected_pictures_of_a_ring_are_copied():
    views, images, wraps = rig('a turned ring')
    surface = views[0].surface
    # Of a focal length with which a quarter turn is a whole number of pixels.
    surface = surface.with_focal(round(surface.circumference_px / 4) * 2 / np.pi)
    corrected = [View(FISHEYE, surface).corrected(image) for image in images]
    sources = [
        View(surface, surface, attitude=view.attitude, seen=image.any(axis=2))
        for view, image in zip(views, corrected, strict=True)
    ]
    layout, out = composed(sources, corrected, wraps, Style())
    assert (
        psnr(out, Scene().view(layout.surface).frame(STAMP_NS)) > FAITHFUL_DB - 3
    )  # resampled twice


@pytest.mark.parametrize('gains', [(1.0, 1.15, 0.9, 1.05)])
def test_gain_compensation_closes_the_ring(gains):
    views, images, wraps = rig('a ring of four')
    unlike = [(image * gain).astype(np.uint8) for image, gain in zip(images, gains, strict=True)]
    compositor = build_compositor(views, unlike, Style(), wraps=wraps)
    evened = np.array(gains) * compositor.gain.factors[:, 0]
    assert evened == pytest.approx(np.full(4, evened[0]), rel=0.01)


def test_the_field_data_follow_the_same_conventions():
    for path in sorted(real_data('field').glob('*/truth.json')):
        truth = json.loads(path.read_text())
        attitudes = [np.reshape(truth['attitude'][name], (3, 3)) for name in truth['cameras']]
        for name, matrix in zip(truth['cameras'], attitudes, strict=True):
            expected = Attitude(*np.radians(truth['axes_deg'][name])).matrix
            assert matrix == pytest.approx(expected, abs=1e-6)
        relative = [a.T @ b for a, b in pairwise(attitudes)]
        closing = attitudes[-1].T @ attitudes[0] if truth['closed'] else None
        found = chain(relative, closing)
        assert found.is_closed == truth['closed']
        down = levelled(found.attitudes, is_closed=found.is_closed)[0].T @ [0, 1, 0]
        if path.parent.name in ('tilt_down_5', 'tilt_down_12', 'mixed_lenses', 'ring_3'):
            assert down == pytest.approx(attitudes[0].T @ [0, 1, 0], abs=1e-6)


MAGENTA = (255, 0, 255)


@pytest.mark.parametrize('blend', BLENDS)
def test_the_robot_itself_is_hidden_where_another_camera_sees_the_place(blend):
    yaws = np.radians([-55, 55])
    attitudes = [Attitude(yaw) for yaw in yaws]
    images = [Scene().view(FISHEYE, attitude).frame(STAMP_NS) for attitude in attitudes]
    # A part of the left picture that the right camera sees too, and one that it does not.
    shared, alone = np.s_[60:180, 255:285], np.s_[100:140, 100:120]
    body = np.zeros(images[0].shape[:2], bool)
    body[shared] = body[alone] = True
    images[0][body] = MAGENTA
    surface = surface_for(FISHEYE)
    masks = [body, None]
    views = [
        View(FISHEYE, surface, attitude=attitude, body=mask)
        for attitude, mask in zip(attitudes, masks, strict=True)
    ]
    style = Style(blend=blend, is_gain_compensated=False)
    layout, out = composed(views, images, False, style)
    truth = Scene().view(layout.surface).frame(STAMP_NS)
    is_body = np.abs(out.astype(int) - MAGENTA).max(axis=2) < 60
    window = layout.surface
    drawn = RemapTable(FISHEYE, window, 'nearest', attitudes[0])(
        np.where(body, 255, 0).astype(np.uint8)
    )
    drawn[:, : window.width // 3] = 0
    assert (drawn > 0).sum() > 1000
    assert not is_body[drawn > 0].any(), 'hidden'
    assert psnr(out, truth, drawn > 0) > FAITHFUL_DB - 15  # its edges are where pixels mix
    assert is_body[:, : window.width // 3].sum() > 500, 'nothing else is known of that place'
