"""Layout and composing, against the scene drawn directly on the panorama's surface."""

import tracemalloc
from dataclasses import replace

import cv2
import numpy as np
import pytest
from scenes import placed_at

from fisheye_capture.scene import Scene
from fisheye_core.errors import ImageFormatError
from fisheye_geometry.attitude import LEVEL, Attitude
from fisheye_geometry.lens import make_lens
from fisheye_geometry.lens_surface import surface_for
from panorama_stitch.compose.blends import BLENDS
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.compose.gain import GainCompensation
from panorama_stitch.compose.layout import covered, lay_out
from panorama_stitch.compose.placing import place
from panorama_stitch.compose.posing import views_at_overlaps
from panorama_stitch.compose.seam_angle import seam_angle_rad
from panorama_stitch.compose.view import View
from panorama_stitch.overlap.overlap_result import Overlap

YAW = np.radians(140)
STAMP_NS = 700_000_000
FAITHFUL_DB = 30.0
"""Two bilinear resamplings of an antialiased scene stay well above it."""
LENS = make_lens(
    'equidistant',
    320,
    240,
    [111.526, 0, 159.5, 0, 111.526, 119.5, 0, 0, 1],
    [-0.02, 0.004, -0.001, 0.0001],
).with_max_angle(np.radians(92))
SEAM_DEG = 2.0
"""Rows of a panorama whose middle is not quite level; seams begin and end in whole columns."""
SMALL_OBJECTS_BYTES = 40_000
"""Slices and the like, a twenty-fifth of a small panorama; they are freed at once."""
SURFACE = surface_for(LENS)
OFFSET = YAW * SURFACE.focal_px


@pytest.fixture(scope='module')
def pictures():
    return [
        Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(STAMP_NS) for yaw in (-YAW / 2, YAW / 2)
    ]


def views_of(pictures, corrected):
    """Both ways to the same panorama: raw pictures, or pictures that were corrected before."""
    if not corrected:
        return [View(LENS, SURFACE)] * 2, pictures
    images = [View(LENS, SURFACE).corrected(picture) for picture in pictures]
    return [View(SURFACE, SURFACE, seen=image.any(axis=2)) for image in images], images


def composed(views, images, offset_px=OFFSET, fade_px=10.0, crop='valid'):
    placed = placed_at(views, (offset_px, 0))
    layout = lay_out(placed, fade_px=fade_px, crop=crop)
    return drawn(layout, placed, images)


def drawn(layout, placed, images):
    shape = (layout.surface.height, layout.surface.width, *images[0].shape[2:])
    out = np.full(shape, 77, np.uint8)
    Compositor(layout, placed).compose(images, out)
    return layout, placed, out


def psnr(a, b, where):
    return 10 * np.log10(255**2 / np.mean((a.astype(float) - b)[where] ** 2))


@pytest.mark.parametrize('corrected', [False, True])
@pytest.mark.parametrize('fade_px', [0.0, 10.0])
def test_it_shows_the_scene(pictures, corrected, fade_px):
    views, images = views_of(pictures, corrected)
    offset = round(OFFSET) if corrected else OFFSET
    layout, placed, out = composed(views, images, offset, fade_px, crop='none')
    truth = Scene().view(layout.surface).frame(STAMP_NS)
    valid = covered(layout, placed)
    assert valid.mean() > 0.7
    assert psnr(out, truth, valid) > FAITHFUL_DB
    outside = cv2.erode((~valid).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    assert (out[outside] == 0).all()


@pytest.mark.parametrize('corrected', [False, True])
def test_a_crop_leaves_no_black_and_keeps_the_field_of_view(pictures, corrected):
    views, images = views_of(pictures, corrected)
    layout, placed, out = composed(views, images, round(OFFSET))
    assert covered(layout, placed).all()
    assert out.any(axis=2).all()
    shown_deg = np.degrees(layout.surface.width / layout.surface.focal_px)
    assert shown_deg > 310 - 2 * 3.0
    assert layout.surface.height > 1.8 * layout.surface.focal_px


@pytest.mark.parametrize('corrected', [False, True])
@pytest.mark.parametrize('offset_px', [OFFSET, round(OFFSET)])
def test_a_crop_leaves_no_black_where_the_right_view_lies_over_the_left(
    pictures, corrected, offset_px
):
    views, images = views_of(pictures, corrected)
    layout, placed, out = composed(
        views, images, round(offset_px) if corrected else offset_px, 0.0
    )
    assert covered(layout, placed).all()
    assert out.any(axis=2).all()


@pytest.mark.parametrize('blend', BLENDS)
def test_every_blend_shows_the_scene_without_allocating_pictures(pictures, blend):
    views = [View(LENS, SURFACE)] * 2
    darker = [pictures[0], (pictures[1] * 0.8).astype(np.uint8)]
    placed = placed_at(views, (OFFSET, 0))
    layout = lay_out(placed, fade_px=10.0 * BLENDS[blend].fade_scale, crop='valid')
    compositor = Compositor(layout, placed, blend, GainCompensation(layout, placed, darker))
    out = np.empty((layout.surface.height, layout.surface.width, 3), np.uint8)
    compositor.compose(darker, out)
    truth = Scene().view(layout.surface, gain=0.8).frame(STAMP_NS)
    assert psnr(out, truth, np.s_[:]) > FAITHFUL_DB
    tracemalloc.start()
    compositor.compose(darker, out)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < SMALL_OBJECTS_BYTES


def test_pictures_that_are_not_live_teach_nothing_about_brightness(pictures):
    views = [View(LENS, SURFACE)] * 2
    placed = placed_at(views, (OFFSET, 0))
    layout = lay_out(placed, fade_px=10.0, crop='valid')
    compositor = Compositor(layout, placed, gain=GainCompensation(layout, placed, pictures))
    out = np.empty((layout.surface.height, layout.surface.width, 3), np.uint8)
    before = compositor.gain.factors
    for _ in range(50):
        compositor.compose([pictures[0] // 3, pictures[1]], out, stale=[0])
    np.testing.assert_array_equal(compositor.gain.factors, before)


def test_a_picture_that_is_not_live_does_not_change_the_gain(pictures):
    views = [View(LENS, SURFACE)] * 2
    placed = placed_at(views, (OFFSET, 0))
    layout = lay_out(placed, fade_px=10.0, crop='valid')
    gain = GainCompensation(layout, placed, pictures)
    compositor = Compositor(layout, placed, gain=gain)
    out = np.empty((layout.surface.height, layout.surface.width, 3), np.uint8)
    dimmed = [pictures[0], pictures[1] // 2]
    for _ in range(60):
        compositor.compose(dimmed, out, stale=[1])
    assert gain.factors == pytest.approx(np.ones((2, 3)), rel=0.01)
    for _ in range(60):
        compositor.compose(dimmed, out)
    assert gain.factors.min() < 0.9


def test_both_ways_give_the_same_picture(pictures):
    raw = composed(*views_of(pictures, corrected=False), offset_px=round(OFFSET), crop='none')[2]
    rect = composed(*views_of(pictures, corrected=True), offset_px=round(OFFSET), crop='none')[2]
    # Corrected pictures mark black pixels that are seen with a 1.
    assert np.abs(raw.astype(int) - rect).max() <= 2


def test_the_center_lies_midway_between_the_axes(pictures):
    views, images = views_of(pictures, corrected=False)
    layout, placed, _ = composed(views, images, crop='none')
    axes = [view.axis for view in placed.views]
    assert layout.surface.center_x_px == pytest.approx(np.mean(axes))
    assert axes[1] - axes[0] == pytest.approx(OFFSET)


def test_none_lays_the_right_frame_over_the_left(pictures):
    _, images = views_of(pictures, corrected=True)
    x = round(OFFSET)
    *_, out = composed([View(SURFACE, SURFACE)] * 2, images, x, fade_px=0.0, crop='none')
    assert (out[:, :x] == images[0][:, :x]).all()
    assert (out[:, x:] == images[1]).all()


@pytest.mark.parametrize('corrected', [False, True])
def test_none_cuts_where_both_show_most(pictures, corrected):
    views, images = views_of(pictures, corrected)
    layout, placed, _ = composed(views, images, round(OFFSET), fade_px=0.0, crop='none')
    begin, end = placed.views[1].begin, placed.views[0].end
    columns = slice(begin, end)
    rows = slice(0, layout.surface.height)
    both = placed.views[0].shows(rows, columns) & placed.views[1].shows(rows, columns)
    shown = both.sum(axis=0)
    assert shown[layout.seams[0].begin - begin] >= 0.98 * shown.max() > 1.1 * shown[0]


def test_frames_without_overlap_stand_side_by_side(pictures):
    views, images = views_of(pictures, corrected=True)
    placed = placed_at(views, (SURFACE.width, 0), found=False)
    layout, _, out = drawn(lay_out(placed, fade_px=10.0, crop='none'), placed, images)
    assert (out == np.hstack(images)).all()
    assert layout.seams[0].begin == layout.seams[0].end == SURFACE.width


def test_a_vertical_offset_moves_the_right_frame_down(pictures):
    views, images = views_of(pictures, corrected=True)
    placed = placed_at(views, (SURFACE.width, 7), found=False)
    layout, _, out = drawn(lay_out(placed, fade_px=0.0, crop='none'), placed, images)
    assert layout.surface.height == SURFACE.height + 7
    assert (out[7:, SURFACE.width :] == images[1]).all()
    assert (out[:7, SURFACE.width :] == 0).all()


def test_a_turned_camera_is_levelled():
    turn = Attitude(pitch_rad=np.radians(2), roll_rad=np.radians(-1.5))
    attitude = Attitude(yaw_rad=YAW / 2, pitch_rad=turn.pitch_rad, roll_rad=turn.roll_rad)
    images = [
        Scene().view(LENS, Attitude(yaw_rad=-YAW / 2)).frame(STAMP_NS),
        Scene().view(LENS, attitude).frame(STAMP_NS),
    ]
    level = [View(LENS, SURFACE)] * 2
    tilted = Overlap('true', True, OFFSET, 0.0, attitude)
    quality = []
    for overlap in (replace(tilted, attitude=LEVEL), tilted):
        placed = place(views_at_overlaps(level, [overlap]))
        layout, _, out = drawn(lay_out(placed, fade_px=10.0, crop='valid'), placed, images)
        truth = Scene().view(layout.surface).frame(STAMP_NS)
        quality.append(psnr(out, truth, np.s_[:]))
    assert quality[1] > FAITHFUL_DB > quality[0]


def test_a_seam_between_views_of_different_brightness_is_a_ramp():
    views = [View(SURFACE, SURFACE)] * 2
    shape = SURFACE.height, SURFACE.width
    images = [np.full(shape, 60, np.uint8), np.full(shape, 160, np.uint8)]
    placed = placed_at(views, (OFFSET, 0))
    layout, _, out = drawn(lay_out(placed, fade_px=20.0, crop='none'), placed, images)
    begin, end = layout.seams[0]
    steps = np.diff(out[:, begin - 2 : end + 2].astype(int), axis=1)
    assert end - begin == 20
    assert steps.min() >= 0
    assert steps.max() <= 100 / 20 + 1
    assert (out[:, :begin] == 60).all()
    assert (out[:, end:] == 160).all()


def test_five_cameras():
    narrow = surface_for(make_lens('plumb_bob', 100, 80, [80, 0, 49.5, 0, 80, 39.5, 0, 0, 1], []))
    views = [View(narrow, narrow)] * 5
    images = [np.full((narrow.height, narrow.width), 40 * (i + 1), np.uint8) for i in range(5)]
    placed = placed_at(views, *[(narrow.width - 20, 0)] * 4)
    layout, _, out = drawn(lay_out(placed, fade_px=8.0, crop='none'), placed, images)
    assert layout.surface.width == 5 * narrow.width - 4 * 20
    assert sorted(set(np.unique(out)) & {40, 80, 120, 160, 200}) == [40, 80, 120, 160, 200]
    assert (np.diff(out.astype(int), axis=1) >= 0).all()


@pytest.mark.parametrize('corrected', [False, True])
def test_a_picture_of_another_size_is_refused(pictures, corrected):
    views, images = views_of(pictures, corrected)
    with pytest.raises(ImageFormatError, match=r'has \d+x100 px'):
        composed(views, [images[0], images[1][:100]])


def test_grey_pictures_give_a_grey_panorama(pictures):
    views, images = views_of(pictures, corrected=False)
    grey = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images]
    placed = placed_at(views, (OFFSET, 0))
    layout = lay_out(placed, fade_px=10.0, crop='valid')
    _, _, out = drawn(layout, placed, grey)
    assert out.min() > 0


@pytest.mark.parametrize('corrected', [False, True])
@pytest.mark.parametrize('is_grey', [False, True])
def test_flow_shows_the_scene_and_fades_where_it_may_not_or_has_no_time(
    pictures, corrected, is_grey
):
    views, images = views_of(pictures, corrected)
    if is_grey:
        images = [cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for image in images]
    placed = placed_at(views, (round(OFFSET), 0))
    layout = lay_out(placed, fade_px=10.0, crop='valid')
    shape = (layout.surface.height, layout.surface.width, *images[0].shape[2:])
    out, faded = np.empty(shape, np.uint8), np.empty(shape, np.uint8)
    compositor, feather = Compositor(layout, placed, 'flow'), Compositor(layout, placed)
    assert compositor.is_costly
    assert not feather.is_costly
    feather.compose(images, faded)
    compositor.compose(images, out)
    assert psnr(out, faded, np.s_[:]) > FAITHFUL_DB
    for options in ({'economical': True}, {'stale': [1]}):
        compositor.compose(images, out, **options)
        assert np.abs(out.astype(int) - faded).max() <= 1


def test_seams_lie_half_way_between_the_axes(pictures):
    views, _ = views_of(pictures, corrected=False)
    placed = placed_at(views, (OFFSET, 0))
    layout = lay_out(placed, fade_px=10.0, crop='valid')
    compositor = Compositor(layout, placed)
    expected = [np.degrees(YAW / 2)] * 2
    angles = [np.degrees(seam_angle_rad(compositor, index)) for index in (0, 1)]
    assert np.allclose(angles, expected, atol=SEAM_DEG)
