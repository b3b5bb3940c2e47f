"""The stitcher: from cameras and pictures to the right panorama, without ROS."""

from dataclasses import replace
from math import nan

import cv2
import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import GeometryError, OverlapError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.image_circle import ImageCircle
from panorama_stitch.overlap.overlap_result import Overlap, with_offset
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.rig_measurement import measure_overlaps
from panorama_stitch.pipeline.rig_state import RigState

YAW = np.radians(140)
LENS = synthetic_lens(640, 480, np.radians(170))
SETTINGS = PanoramaSettings()
CLOSE_PX = 1.0


@pytest.fixture(scope='module')
def pictures():
    return [Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0) for yaw in (-YAW / 2, YAW / 2)]


def stitcher_of(lenses=(LENS, LENS), names=('left', 'right')):
    stitcher = RigState(names)
    for name, lens in zip(names, lenses, strict=True):
        stitcher.place(name, lens, SETTINGS.surface_of(lens))
    return stitcher


def test_it_measures_the_offset_of_the_synthetic_rig(pictures):
    stitcher = stitcher_of()
    (overlap,) = measure_overlaps(stitcher, [pictures], SETTINGS, 'particles')
    assert overlap.found
    assert overlap.offset_x_px == pytest.approx(YAW * LENS.focal_x_px, abs=CLOSE_PX)
    assert overlap.offset_y_px == pytest.approx(0, abs=CLOSE_PX)


def test_cameras_of_different_focal_length_get_one(pictures):
    longer = replace(LENS, focal_x_px=LENS.focal_x_px * 1.02, focal_y_px=LENS.focal_y_px * 1.02)
    right = Scene().view(longer, Attitude(yaw_rad=YAW / 2)).frame(0)
    stitcher = stitcher_of((LENS, longer))
    left_surface, right_surface = stitcher.surfaces
    assert left_surface.focal_px == right_surface.focal_px
    (overlap,) = measure_overlaps(stitcher, [[pictures[0], right]], SETTINGS, 'particles')
    expected = YAW * LENS.focal_x_px + left_surface.center_x_px - right_surface.center_x_px
    assert overlap.offset_x_px == pytest.approx(expected, abs=CLOSE_PX)


def test_without_a_measurement_the_frames_stand_side_by_side(pictures):
    stitcher = stitcher_of()
    layout = stitcher.compositor(SETTINGS, pictures).layout
    assert layout.surface.width == sum(surface.width for surface in stitcher.surfaces)


def test_an_offset_set_by_hand_wins_and_nan_gives_the_measured_one_back(pictures):
    stitcher = stitcher_of()
    stitcher.overlaps = measure_overlaps(stitcher, [pictures], SETTINGS, 'particles')
    by_hand = stitcher.effective_overlaps(
        replace(SETTINGS, offset_x_px=(500.0,), offset_y_px=(nan,))
    )[0]
    assert (by_hand.offset_x_px, by_hand.method) == (500.0, 'manual')
    assert by_hand.offset_y_px == stitcher.overlaps[0].offset_y_px
    assert stitcher.effective_overlaps(SETTINGS) == stitcher.overlaps


TURNED = Overlap('particles', True, attitude=Attitude(*np.radians((140.0, 4.0, -3.0))))


def on_now(stitcher, overlap):
    """What an overlap says on the surfaces in use."""
    (pair,) = stitcher.pairs
    attitudes = stitcher.solution([overlap], SETTINGS).rig.attitudes(pair)
    return with_offset(overlap, *stitcher.surfaces, attitudes)


@pytest.mark.parametrize('kind', ['cylindrical', 'equirectangular'])
@pytest.mark.parametrize('is_corrected', [False, True])
def test_an_overlap_holds_for_any_part_of_what_its_cameras_see(kind, is_corrected):
    settings = replace(SETTINGS, surface=kind)
    stitcher = RigState(('left', 'right'))

    def place(camera, lens, how=settings):
        surface = how.surface_of(lens)
        return stitcher.place(camera, surface if is_corrected else lens, surface)

    for camera in stitcher.cameras:
        place(camera, LENS)
    stitcher.overlaps = [TURNED]
    (before,) = stitcher.overlaps = [on_now(stitcher, TURNED)]
    assert not place('left', LENS), 'nothing new'
    assert stitcher.overlaps == [before]
    narrow = LENS.with_max_angle(np.radians(75))
    cropped = replace(settings, hfov_deg=120.0, vfov_deg=70.0)
    for camera, lens, how in (('left', narrow, settings), ('right', LENS, cropped)):
        assert place(camera, lens, how)
        (after,) = stitcher.overlaps
        expected = on_now(stitcher, before)
        assert after.attitude == TURNED.attitude
        assert after.offset_x_px == pytest.approx(expected.offset_x_px)
        assert after.offset_y_px == pytest.approx(expected.offset_y_px)
        assert after.overlap_px == pytest.approx(expected.overlap_px)
        assert after.offset_x_px != pytest.approx(before.offset_x_px, abs=1.0)


def test_another_lens_or_kind_of_surface_makes_the_overlap_void():
    longer = replace(LENS, focal_x_px=LENS.focal_x_px + 1.0)
    sphere = replace(SETTINGS, surface='equirectangular').surface_of(LENS)
    for source, surface in ((longer, SETTINGS.surface_of(longer)), (LENS, sphere)):
        stitcher = stitcher_of()
        stitcher.overlaps = [TURNED]
        assert stitcher.place('left', source, surface)
        assert stitcher.overlaps is None


def test_an_offset_alone_holds_for_its_surfaces_only():
    narrow = LENS.with_max_angle(np.radians(75))
    stitcher = stitcher_of()
    stitcher.overlaps = [replace(TURNED, attitude=None, offset_x_px=500.0)]
    assert stitcher.place('left', narrow, SETTINGS.surface_of(narrow))
    assert stitcher.overlaps is None


def test_where_one_pair_was_found_the_other_stays_side_by_side():
    narrow = LENS.with_max_angle(np.radians(75))
    stitcher = stitcher_of((LENS,) * 3, ('left', 'middle', 'right'))
    apart = Overlap('particles', False, offset_x_px=float(stitcher.surfaces[1].width))
    stitcher.overlaps = [TURNED, apart]
    assert stitcher.place('middle', narrow, SETTINGS.surface_of(narrow))
    assert [overlap.found for overlap in stitcher.overlaps] == [True, False]
    assert stitcher.overlaps[1].offset_x_px == stitcher.surfaces[1].width


def test_what_was_measured_on_other_surfaces_is_not_taken(pictures):
    stitcher = stitcher_of()
    surfaces = stitcher.surfaces
    overlaps = measure_overlaps(stitcher, [pictures], SETTINGS, 'particles')
    stitcher.place('left', LENS, replace(SETTINGS, hfov_deg=150.0).surface_of(LENS))
    assert not stitcher.set_overlaps(overlaps, surfaces)
    assert stitcher.overlaps is None
    assert stitcher.set_overlaps(overlaps, stitcher.surfaces)


def test_a_surface_that_would_become_absurd_is_refused():
    stitcher = stitcher_of()
    before = stitcher.surfaces
    tiny = replace(before[0], focal_px=before[0].focal_px / 1000)
    with pytest.raises(GeometryError):
        stitcher.place('right', tiny, tiny)
    assert stitcher.surfaces == before


def test_nothing_to_measure_on_is_said(pictures):
    with pytest.raises(OverlapError, match='no pair of frames has come yet'):
        measure_overlaps(stitcher_of(), [], SETTINGS, 'particles')


def test_three_cameras():
    yaws = np.radians([-120, 0, 120])
    pictures = [Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0) for yaw in yaws]
    stitcher = stitcher_of((LENS,) * 3, ('left', 'middle', 'right'))
    stitcher.overlaps = measure_overlaps(stitcher, [pictures], SETTINGS, 'correlation')
    expected = pytest.approx(np.radians(120) * LENS.focal_x_px, abs=CLOSE_PX)
    assert [overlap.offset_x_px for overlap in stitcher.overlaps] == [expected] * 3
    compositor = stitcher.compositor(SETTINGS, pictures)
    out = np.empty(
        (compositor.layout.surface.height, compositor.layout.surface.width, 3), np.uint8
    )
    compositor.compose(pictures, out)
    assert out.any(axis=2).all()


def test_a_dark_circle_is_no_part_of_the_panorama(pictures):
    circle = ImageCircle(LENS)
    lit = Scene().view(LENS.with_max_angle(np.radians(80)), Attitude(yaw_rad=-YAW / 2)).frame(0)
    assert circle.look(lit)
    lens = LENS.with_max_angle(circle.angle_rad)
    assert SETTINGS.surface_of(lens).width < SETTINGS.surface_of(LENS).width


def over_jpeg(picture, quality):
    coded = cv2.imencode('.jpg', picture, (cv2.IMWRITE_JPEG_QUALITY, quality))[1]
    return cv2.imdecode(coded, cv2.IMREAD_COLOR)


@pytest.mark.parametrize('quality', [95, 80, 60])
def test_jpeg_makes_no_tilt(pictures, quality):
    received = [over_jpeg(picture, quality) for picture in pictures]
    (overlap,) = measure_overlaps(stitcher_of(), [received], SETTINGS, 'particles')
    assert abs(overlap.attitude.pitch_rad) < np.radians(0.05)
    assert abs(overlap.attitude.roll_rad) < np.radians(0.05)
    assert abs(overlap.offset_y_px) < 0.1


def test_a_small_tilt_is_measured():
    turns = Attitude(yaw_rad=-YAW / 2), Attitude(YAW / 2, np.radians(0.3), np.radians(0.2))
    tilted = [Scene().view(LENS, turn).frame(0) for turn in turns]
    (overlap,) = measure_overlaps(stitcher_of(), [tilted], SETTINGS, 'particles')
    assert np.degrees(overlap.attitude.pitch_rad) == pytest.approx(0.3, abs=0.1)
    assert np.degrees(overlap.attitude.roll_rad) == pytest.approx(0.2, abs=0.1)
