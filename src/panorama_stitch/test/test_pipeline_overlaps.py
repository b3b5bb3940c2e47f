"""Overlaps in the pipeline: measured while panoramas go on, kept, inherited, and told."""

import re
import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from pipeline_line import DEADLINE_S, HASTY, LENS, SETTINGS, overlap_in_use

from fisheye_capture.scene import Scene
from fisheye_core.errors import FileAccessError, ImageFormatError, OverlapError
from fisheye_geometry.attitude import Attitude
from fisheye_testing.waiting import wait_for
from panorama_stitch.overlap.overlap_result import side_by_side
from panorama_stitch.pipeline import compositor_builder

LENS_SURFACE = SETTINGS.surface_of(LENS)


def test_panoramas_go_on_while_the_overlap_is_measured(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    answer = line.pipeline.calibrate('correlation', save=False)
    line.feed(pictures, answer.done, 'an answer')
    assert answer.result()[0].found


@pytest.fixture
def hold_measurements(monkeypatch):
    """Make measurements wait; gives the events that tell that one began, and that let them go."""
    measure = compositor_builder.measure_overlaps

    def hold():
        is_measuring, resume = threading.Event(), threading.Event()

        def measure_late(*arguments):
            is_measuring.set()
            resume.wait(DEADLINE_S)
            return measure(*arguments)

        monkeypatch.setattr(compositor_builder, 'measure_overlaps', measure_late)
        return is_measuring, resume

    return hold


def test_who_asks_again_meanwhile_gets_the_same_measurement(
    make_line, pictures, hold_measurements
):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    _, resume = hold_measurements()
    first = line.pipeline.calibrate('correlation', save=False)
    assert line.pipeline.calibrate('correlation', save=False) is first
    other = line.pipeline.calibrate('', save=False)
    assert other is not first
    resume.set()
    line.feed(pictures, other.done, 'an answer')
    assert first.result()[0].found
    assert line.pipeline.calibrate('', save=False) is not other


def test_an_answer_without_overlap_never_replaces_a_good_one(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    good = []

    def is_lost():
        good.append(overlap_in_use(line))
        return not line.pipeline.calibrate('', save=False).result(DEADLINE_S)[0].found

    line.feed(dark, is_lost, 'an answer without overlap, once the bright pictures are forgotten')
    assert overlap_in_use(line) == good[-1]
    assert good[-1].found


def test_what_was_found_before_stays_while_the_rest_is_sought(make_line, monkeypatch):
    cameras = 'left', 'front', 'right'
    line = make_line(replace(SETTINGS, cameras=cameras))
    yaws = np.radians((-80, 0, 80))
    pictures = {
        camera: Scene().view(LENS, Attitude(yaw_rad=yaw)).frame(0)
        for camera, yaw in zip(cameras, yaws, strict=True)
    }
    measure, tries = compositor_builder.measure_overlaps, []

    def measure_some(*arguments):
        tries.append(len(tries))
        return [
            overlap if index <= tries[-1] else side_by_side(LENS_SURFACE, 'particles', '')
            for index, overlap in enumerate(measure(*arguments))
        ]

    monkeypatch.setattr(compositor_builder, 'measure_overlaps', measure_some)

    def found():
        return [overlap.found for overlap in line.pipeline.overlaps]

    line.feed(pictures, lambda: found() == [True, False], 'the first overlap')
    first = overlap_in_use(line)
    line.feed(pictures, lambda: found() == [True, True], 'the other one too')
    assert tries == [0, 1]
    assert overlap_in_use(line) is first, 'no seam moves by itself'


def test_night_at_start_is_tried_again(make_line, pictures):
    line = make_line()
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    line.feed(dark, lambda: line.published, 'a dark panorama, side by side')
    assert not overlap_in_use(line).found
    line.feed(pictures, lambda: overlap_in_use(line).found, 'an overlap after all')


def test_an_overlap_is_kept_in_its_file(make_line, pictures, tmp_path):
    path = tmp_path / 'overlap.yaml'
    settings = replace(SETTINGS, overlap_file=str(path))
    first = make_line(settings)
    first.feed(pictures, lambda: first.published, 'a panorama')
    first.pipeline.calibrate('', save=True).result(DEADLINE_S)
    second = make_line(replace(settings, auto_calibrate=False))
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    second.feed(dark, lambda: second.published, 'a panorama')
    assert overlap_in_use(second).offset_x_px == pytest.approx(overlap_in_use(first).offset_x_px)
    path.write_text('version: 77')
    third = make_line(settings)
    third.feed(pictures, lambda: third.published, 'a panorama')
    assert overlap_in_use(third).found
    assert 'the overlap is measured instead' in third.warnings[0]


def test_a_pipeline_goes_on_with_the_overlap_of_the_former_one(make_line, pictures):
    first = make_line()
    first.feed(pictures, lambda: first.published, 'a panorama')
    (measured,) = first.pipeline.overlaps
    assert measured.found
    first.stop()
    second = make_line(replace(SETTINGS, auto_calibrate=False))
    second.pipeline.inherit(first.pipeline)
    second.feed(pictures, lambda: second.published, 'a panorama')
    assert second.pipeline.overlaps == [measured]


def test_overlaps_of_other_lenses_are_not_inherited(make_line, pictures):
    first = make_line()
    first.feed(pictures, lambda: first.published, 'a panorama')
    second = make_line(replace(SETTINGS, auto_calibrate=False))
    other = replace(LENS, focal_x_px=LENS.focal_x_px + 1.0)
    second.pipeline.place('left', other, SETTINGS.surface_of(other))
    second.pipeline.inherit(first.pipeline)
    second.feed(pictures, lambda: second.published, 'a panorama')
    assert not second.pipeline.overlaps[0].found


@pytest.mark.parametrize('is_saved', [False, True])
def test_an_overlap_holds_where_less_of_the_same_lens_is_lit(
    make_line, pictures, tmp_path, is_saved
):
    path = tmp_path / 'overlap.yaml'
    settings = replace(SETTINGS, overlap_file=str(path) if is_saved else '')
    first = make_line(settings)
    first.feed(pictures, lambda: first.published, 'a panorama')
    second = make_line(replace(settings, auto_calibrate=False))
    if is_saved:
        first.pipeline.calibrate('', save=True).result(DEADLINE_S)
    else:
        second.pipeline.inherit(first.pipeline)
    for camera, angle_rad in (('left', 1.4), ('right', 1.3)):
        lens = LENS.with_max_angle(angle_rad)
        second.pipeline.place(camera, lens, SETTINGS.surface_of(lens))
    second.feed(pictures, lambda: second.published, 'a panorama')
    assert overlap_in_use(second).found
    left, right = second.pipeline.rig.surfaces
    expected_px = overlap_in_use(first).offset_x_px + left.center_x_px - right.center_x_px
    assert overlap_in_use(second).offset_x_px == pytest.approx(expected_px)
    assert second.warnings == []


def test_what_cannot_be_done_is_said(make_line, pictures, tmp_path):
    line = make_line()
    with pytest.raises(OverlapError, match='no pair of frames has come yet'):
        line.pipeline.calibrate('', save=False).result(DEADLINE_S)
    line.feed(pictures, lambda: line.published, 'a panorama')
    with pytest.raises(OverlapError, match='overlap_file is empty'):
        line.pipeline.calibrate('', save=True).result(DEADLINE_S)
    with pytest.raises(ImageFormatError, match='right has 10x10 px; expected 320x240'):
        line.take('right', np.zeros((10, 10, 3), np.uint8))
    (tmp_path / 'file').write_text('')
    line.pipeline.apply(replace(SETTINGS, overlap_file=str(tmp_path / 'file' / 'overlap.yaml')))
    before = overlap_in_use(line)
    with pytest.raises(FileAccessError, match='cannot be written'):
        line.pipeline.calibrate('', save=True).result(DEADLINE_S)
    assert overlap_in_use(line) is before, 'what was in use stays in use'


def test_what_cameras_showed_before_one_fell_silent_is_not_measured(
    make_line, pictures, monkeypatch
):
    monkeypatch.setattr(compositor_builder, '_OLDEST_S', 0.6)
    line = make_line()

    def all_live():
        return line.published and not line.published[-1][2]

    def feed_for_long(step):
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            step()
            time.sleep(0.02)

    def only_left():
        line.take('left', pictures['left'])

    def far_apart():
        only_left()
        line.take('right', pictures['right'], later_ns=10**12)

    def refusal(step):
        feed_for_long(step)
        with pytest.raises(OverlapError) as refused:
            line.pipeline.calibrate('', save=False).result(DEADLINE_S)
        return str(refused.value)

    for step, wrong in (
        (only_left, r'^right has given no frame for \d+ s; expected frames of all .* last 0.6 s'),
        (far_apart, r'^no frames have belonged together for \d+ s; expected frames of all'),
    ):
        line.pipeline.apply(SETTINGS)
        line.feed(pictures, all_live, 'a panorama')
        good = overlap_in_use(line)
        line.pipeline.apply(HASTY)
        wait_for(lambda step=step, wrong=wrong: re.match(wrong, refusal(step)), what=wrong)
        assert overlap_in_use(line) is good
        line.published.clear()
        line.stamp_ns += 2 * 10**12
    line.pipeline.apply(SETTINGS)
    line.feed(pictures, all_live, 'a panorama of both again')
    assert line.pipeline.calibrate('', save=False).result(DEADLINE_S)[0].found


def test_what_was_not_found_is_not_saved(make_line, pictures, tmp_path):
    path = tmp_path / 'overlap.yaml'
    line = make_line(replace(SETTINGS, overlap_file=str(path)))
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    line.feed(dark, lambda: line.published, 'a dark panorama')
    line.pipeline.calibrate('', save=True).result(DEADLINE_S)
    assert not path.exists()


def test_a_file_that_cannot_even_be_looked_at_is_said(make_line, pictures):
    line = make_line(replace(SETTINGS, overlap_file='x' * 5000))
    line.feed(pictures, lambda: line.published, 'a panorama')
    assert 'cannot be read' in line.warnings[0]


def test_an_overlap_has_the_stamp_of_the_images_it_was_measured_on(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    assert 0 < overlap_in_use(line).stamp_ns <= line.published[0][0] <= line.stamp_ns


def test_the_published_rule_asked_for_once_ruins_no_rig(make_line, pictures):
    line = make_line(replace(SETTINGS, min_confidence=0.5))
    line.feed(pictures, lambda: line.published, 'a panorama')
    good = overlap_in_use(line)
    (asked,) = line.pipeline.calibrate('paper', save=False).result(DEADLINE_S)
    assert (asked.method, asked.found) == ('paper', False)
    assert asked.confidence < 0.5
    assert 'the most similar particles put the right view at' in asked.message
    assert '0.50 is needed (with the parameter method:=paper' in asked.message
    assert overlap_in_use(line) == good
    line.pipeline.apply(replace(SETTINGS, method='paper', min_confidence=0.5))
    (asked,) = line.pipeline.calibrate('', save=False).result(DEADLINE_S)
    assert asked.found
    assert overlap_in_use(line) == asked


def test_a_setting_that_changes_while_an_overlap_is_sought_need_not_wait(
    make_line, pictures, monkeypatch, hold_measurements
):
    monkeypatch.setattr(compositor_builder, '_FIRST_PAUSE_S', 60.0)
    line = make_line(replace(SETTINGS, stale_after_s=60.0))
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    is_measuring, resume = hold_measurements()
    line.feed(dark, is_measuring.is_set, 'a search')
    line.pipeline.apply(replace(SETTINGS, stale_after_s=60.0, crop='none', feather_deg=3.0))
    is_measuring.clear()
    resume.set()
    line.feed(dark, is_measuring.is_set, 'the next search, without the pause between two')
