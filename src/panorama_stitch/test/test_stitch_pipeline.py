"""The pipeline: pairs become panoramas, a silent camera is shown as such and comes back."""

import gc
import time
from dataclasses import replace
from functools import partial
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
from pipeline_line import DEADLINE_S, HASTY, LENS, SETTINGS, STEP_NS, YAW, Line, overlap_in_use

from fisheye_capture.synthetic import synthetic_lens
from fisheye_geometry.remap import RemapTable
from fisheye_testing.waiting import wait_for
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline import pairing
from panorama_stitch.pipeline.metrics import (
    economy_sentence,
    lag_sentence,
    metrics,
    unpaired_sentence,
)

TABLES = 3
"""A compositor needs at most so many for each camera: drawing, seams, gain."""


def test_pairs_become_panoramas_with_a_measured_offset(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    assert overlap_in_use(line).offset_x_px == pytest.approx(YAW * LENS.focal_x_px, abs=1.0)
    assert line.published[0][2] == {}
    assert line.warnings == []


def test_a_silent_camera_is_shown_as_such_and_comes_back(make_line, pictures):
    settings = replace(SETTINGS, blend='feather')  # flow settles over some frames
    line = make_line(settings)
    line.feed(pictures, lambda: line.published, 'a panorama')
    bright, last_ns = line.published[-1][1], line.stamp_ns
    line.pipeline.apply(replace(HASTY, blend='feather'))
    left = {'left': pictures['left']}
    line.feed(left, lambda: line.published[-1][2], 'a panorama of the living side')
    stamp_ns, dimmed, ages_s = line.published[-1]
    assert list(ages_s) == ['right']
    assert last_ns < stamp_ns <= line.stamp_ns, 'the stamp of the living side'
    half = bright.shape[1] // 3
    assert (dimmed[:, :half] == bright[:, :half]).all()
    assert dimmed[:, -half:].mean() < 0.5 * bright[:, -half:].mean()
    line.pipeline.apply(settings)
    line.feed(pictures, lambda: not line.published[-1][2], 'both sides again')
    assert (line.published[-1][1] == bright).all()


def test_a_camera_that_never_came_is_black_and_then_measured(make_line, pictures):
    line = make_line(HASTY)
    right = {'right': pictures['right']}
    line.feed(right, lambda: line.published, 'a panorama of one camera')
    _, picture, ages_s = line.published[-1]
    assert list(ages_s) == ['left']
    above_text = picture.shape[0] // 4
    assert picture[:above_text, : picture.shape[1] // 3].max() == 0
    line.feed(
        pictures, lambda: line.pipeline.rig.overlaps and not line.published[-1][2], 'both sides'
    )
    assert overlap_in_use(line).found


def test_without_time_flow_is_left_out_and_that_is_told(make_line, pictures):
    line = make_line(replace(SETTINGS, blend='flow'))
    line.feed(pictures, lambda: line.published, 'a panorama')
    pipeline = line.pipeline
    for is_on, name in ((False, 'off'), (True, 'on')):
        pipeline.economy = Mock(is_on=is_on, **{'started.return_value': is_on})
        line.economical.clear()
        line.feed(pictures, partial(line.economical.__contains__, is_on), f'economy {name}')
        wait_for(lambda: pipeline.economy.ended.called, what='the end of its work')
        assert metrics(pipeline)['economy'] == name
        assert ('no time for blend:=flow' in economy_sentence(pipeline)) == is_on
        assert pipeline.economy.arrived.called


def test_with_both_silent_nothing_is_published(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    line.pipeline.apply(HASTY)
    wait_for(lambda: len(line.pipeline.frames.ages_s()) == 2, what='the silence')

    def none_come():
        count = len(line.published)
        line.news.wait(0.3)
        return len(line.published) == count

    wait_for(none_come, what='the end of what waited')


def test_a_setting_applies_to_the_next_frames(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    width = line.published[-1][1].shape[1]
    line.pipeline.apply(replace(SETTINGS, offset_x_px=(200.0,)))
    line.feed(pictures, lambda: line.published[-1][1].shape[1] < width, 'a narrower panorama')
    line.pipeline.apply(SETTINGS)
    line.feed(pictures, lambda: line.published[-1][1].shape[1] == width, 'the measured one back')


def test_another_lens_is_measured_anew(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    former = overlap_in_use(line)
    small = synthetic_lens(160, 120, np.radians(170))
    shrunk = {name: cv2.resize(picture, (160, 120)) for name, picture in pictures.items()}
    for camera in shrunk:
        line.pipeline.place(camera, small, SETTINGS.surface_of(small))
    count = len(line.published)
    line.feed(shrunk, lambda: len(line.published) > count + 3, 'panoramas of the other lens')
    assert overlap_in_use(line).offset_x_px == pytest.approx(former.offset_x_px / 2, abs=1.0)


def test_pictures_that_waited_while_the_lens_changed_stop_nothing(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    line.may_draw.clear()
    for _ in range(3):
        line.stamp_ns += STEP_NS
        for camera, picture in pictures.items():
            line.take(camera, picture)
    small = synthetic_lens(160, 120, np.radians(170))
    shrunk = {name: cv2.resize(picture, (160, 120)) for name, picture in pictures.items()}
    for camera in shrunk:
        line.pipeline.place(camera, small, SETTINGS.surface_of(small))
    line.may_draw.set()
    count = len(line.published)
    line.feed(shrunk, lambda: len(line.published) > count + 3, 'panoramas of the other lens')
    assert line.pipeline.trouble == ''


def test_colour_beside_grey_wins_whoever_comes_first(make_line, pictures):
    line = make_line(replace(SETTINGS, gain_compensation=False))
    grey = {name: cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) for name, image in pictures.items()}
    line.feed({**pictures, 'left': grey['left']}, lambda: line.published, 'a panorama')
    first = line.published[-1][1]
    third = first.shape[1] // 3
    assert np.ptp(first[:, :third], axis=2).max() == 0, 'the left is grey'
    assert np.ptp(first[:, -third:], axis=2).max() > 50, 'the right is in colour'
    line.feed(grey, lambda: line.published[-1][1].ndim == 2, 'a grey panorama')
    line.feed(pictures, lambda: line.published[-1][1].ndim == 3, 'one in colour again')
    assert line.warnings == []


def stamps_apart(line, pictures, seconds, until, what):
    """Feed frames whose stamps differ by a constant; return the stamp of the left one."""
    deadline = time.monotonic() + DEADLINE_S
    while not until():
        assert time.monotonic() < deadline, what
        line.stamp_ns += STEP_NS
        line.take('left', pictures['left'])
        line.take('right', pictures['right'], round(seconds * 1e9))
        line.news.wait(0.01)


def test_cameras_of_different_clocks_are_paired_by_arrival(make_line, pictures):
    line = make_line()
    apart = (line, pictures, -37.0)
    stamps_apart(*apart, lambda: line.stamp_ns > 20 * STEP_NS, 'time for a pair')
    assert not line.published
    sentence = unpaired_sentence(line.pipeline)
    assert sentence.endswith('pair_by:=arrival joins what arrives together')
    assert 'the stamps of the cameras are 37 s apart' in sentence
    line.pipeline.apply(replace(SETTINGS, pair_by='arrival'))
    stamps_apart(*apart, lambda: len(line.published) > 5, 'panoramas')
    assert line.published[-1][0] <= line.stamp_ns - 37 * 10**9, 'the older stamp'
    line.pipeline.apply(SETTINGS)
    line.feed(pictures, lambda: line.published[-1][0] > 0, 'pairs by stamp again')


def test_a_camera_that_comes_too_late_is_named(make_line, pictures, monkeypatch):
    monkeypatch.setattr(pairing, 'ROOM_BYTES', 1_000_000)
    line = make_line()
    stamps_apart(line, pictures, -2.0, lambda: line.stamp_ns > 20 * STEP_NS, 'time for a pair')
    sentence = unpaired_sentence(line.pipeline)
    assert 'right comes 2000 ms later than left, more than can wait in ' in sentence


def test_a_camera_that_all_wait_for_is_named(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: len(line.published) > 5, 'panoramas')
    assert lag_sentence(line.pipeline) == ''
    sentence = 'right comes 1000 ms later than left by its stamps, and the panorama with it'
    stamps_apart(
        line, pictures, -1.0, lambda: sentence in lag_sentence(line.pipeline), 'the sentence'
    )
    line.pipeline.apply(replace(SETTINGS, pair_by='arrival'))
    assert lag_sentence(line.pipeline) == ''


def test_a_lens_that_changes_with_each_frame_stops_no_panorama(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    count = len(line.published)
    for index in range(1, 21):
        lens = replace(LENS, focal_x_px=LENS.focal_x_px + 0.01 * index)
        line.pipeline.place('left', lens, SETTINGS.surface_of(lens))
        line.feed(pictures, lambda seen=count + index: len(line.published) >= seen, 'the next one')
    assert not line.pipeline.frames.unpaired_s


def test_what_was_made_for_former_settings_is_let_go(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    for hfov_deg in range(140, 146):
        settings = replace(SETTINGS, hfov_deg=float(hfov_deg))
        former = line.pipeline.compositor
        line.pipeline.apply(settings)
        for camera in settings.cameras:
            line.pipeline.place(camera, LENS, settings.surface_of(LENS))
        line.feed(
            pictures,
            lambda seen=former: line.pipeline.compositor is not seen,
            'another compositor',
        )
    gc.collect()
    alive = [type(thing) for thing in gc.get_objects()]
    lines = 1 + alive.count(Line)
    assert alive.count(Compositor) <= 2 * lines, 'the one in use, and the one being made'
    tables = 4 + 2 * lines * len(SETTINGS.cameras) * TABLES
    assert alive.count(RemapTable) <= tables
