"""The pipeline: pairs become panoramas, a silent camera is shown as such and comes back."""

import gc
import threading
import time
from dataclasses import replace
from functools import partial
from unittest.mock import Mock

import cv2
import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.synthetic import synthetic_lens
from fisheye_core.errors import FileAccessError, ImageFormatError, OverlapError
from fisheye_geometry.attitude import Attitude
from fisheye_geometry.remap import RemapTable
from panorama_stitch.compose.compositor import Compositor
from panorama_stitch.pipeline import compositor_builder
from panorama_stitch.pipeline.metrics import economy_sentence, metrics, unpaired_sentence
from panorama_stitch.pipeline.panorama_settings import PanoramaSettings
from panorama_stitch.pipeline.stitch_pipeline import StitchPipeline

LENS = synthetic_lens(320, 240, np.radians(170))
YAW = np.radians(140)
SETTINGS = PanoramaSettings(stale_after_s=0.2)
DEADLINE_S = 20.0
STEP_NS = 33_000_000
TABLES = 3
"""A compositor needs at most so many for each camera: drawing, seams, gain."""


@pytest.fixture(scope='module')
def pictures():
    views = [Scene().view(LENS, Attitude(yaw_rad=yaw)) for yaw in (-YAW / 2, YAW / 2)]
    return dict(zip(('left', 'right'), (view.frame(0) for view in views), strict=True))


class Line:
    """A pipeline, what it made, and a hand that feeds it."""

    def __init__(self, settings=SETTINGS):
        self.published, self.warnings, self.economical = [], [], []
        self.news, self.may_draw = threading.Event(), threading.Event()
        self.may_draw.set()
        self.pipeline = StitchPipeline(settings)
        for camera in settings.cameras:
            self.pipeline.place(camera, LENS, settings.surface_of(LENS))
        self.stamp_ns = 0
        self._thread = threading.Thread(target=self._draw, daemon=True)
        self._thread.start()

    def stop(self):
        self.pipeline.stop()
        self._thread.join()

    def _draw(self):
        while (panorama := self.pipeline.next()) is not None:
            assert self.may_draw.wait(DEADLINE_S)
            surface, image = panorama.surface, panorama.images[0]
            out = np.empty((surface.height, surface.width, *image.shape[2:]), np.uint8)
            panorama.draw(out)
            self.published.append((panorama.stamp_ns, out, panorama.stale))
            self.economical.append(panorama.is_economical)

    def feed(self, pictures, until, what):
        """Feed frames of these cameras until a condition holds."""
        deadline = time.monotonic() + DEADLINE_S
        while not until():
            assert time.monotonic() < deadline, what
            self.stamp_ns += STEP_NS
            for camera, picture in pictures.items():
                self.take(camera, picture)
            self.warnings += self.pipeline.take_notices()
            self.news.wait(0.01)

    def take(self, camera, picture, later_ns=0):
        encoding = 'mono8' if picture.ndim == 2 else 'bgr8'
        self.pipeline.take(camera, self.stamp_ns + later_ns, picture, encoding)


@pytest.fixture
def make_line():
    lines = []

    def make(settings=SETTINGS):
        lines.append(Line(settings))
        return lines[-1]

    yield make
    for line in lines:
        line.stop()


def overlap_in_use(line):
    return line.pipeline.rig.overlaps[0]


def test_pairs_become_panoramas_with_a_measured_offset(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    assert overlap_in_use(line).offset_x_px == pytest.approx(YAW * LENS.focal_x_px, abs=1.0)
    assert line.published[0][2] == {}
    assert line.warnings == []


def test_a_silent_camera_is_shown_as_such_and_comes_back(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    bright = line.published[-1][1]
    left = {'left': pictures['left']}
    line.feed(left, lambda: line.published[-1][2], 'a panorama of the living side')
    stamp_ns, dimmed, ages_s = line.published[-1]
    assert list(ages_s) == ['right']
    assert stamp_ns == line.stamp_ns, 'the stamp of the living side'
    half = bright.shape[1] // 3
    assert (dimmed[:, :half] == bright[:, :half]).all()
    assert dimmed[:, -half:].mean() < 0.5 * bright[:, -half:].mean()
    line.feed(pictures, lambda: not line.published[-1][2], 'both sides again')
    assert (line.published[-1][1] == bright).all()


def test_a_camera_that_never_came_is_black_and_then_measured(make_line, pictures):
    line = make_line()
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
        assert metrics(pipeline)['economy'] == name
        assert ('no time for blend:=flow' in economy_sentence(pipeline)) == is_on
        assert pipeline.economy.arrived.called
        assert pipeline.economy.ended.called


def test_with_both_silent_nothing_is_published(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    deadline = time.monotonic() + DEADLINE_S
    while len(line.pipeline.frames.ages_s()) < 2:
        assert time.monotonic() < deadline
        line.news.wait(0.02)
    count = len(line.published)
    line.news.wait(0.3)
    assert len(line.published) == count


def test_panoramas_go_on_while_the_overlap_is_measured(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    answer = line.pipeline.calibrate('correlation', save=False)
    line.feed(pictures, answer.done, 'an answer')
    assert answer.result()[0].found


def test_who_asks_again_meanwhile_gets_the_same_measurement(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    first = line.pipeline.calibrate('correlation', save=False)
    assert line.pipeline.calibrate('correlation', save=False) is first
    other = line.pipeline.calibrate('', save=False)
    assert other is not first
    line.feed(pictures, other.done, 'an answer')
    assert first.result()[0].found
    assert line.pipeline.calibrate('', save=False) is not other


def test_an_answer_without_overlap_never_replaces_a_good_one(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    good = overlap_in_use(line)
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    end = time.monotonic() + 1.5
    line.feed(dark, lambda: time.monotonic() > end, 'time to forget the bright pictures')
    assert not line.pipeline.calibrate('', save=False).result(DEADLINE_S)[0].found
    assert overlap_in_use(line) == good


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
    second = make_line(replace(SETTINGS, auto_calibrate=False, hfov_deg=150.0))
    second.pipeline.inherit(first.pipeline)
    second.feed(pictures, lambda: second.published, 'a panorama')
    assert not second.pipeline.overlaps[0].found


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
    end = time.monotonic() + 0.5
    stamps_apart(*apart, lambda: time.monotonic() > end, 'time for a pair')
    assert not line.published
    sentence = unpaired_sentence(line.pipeline)
    assert sentence.endswith('pair_by:=arrival joins what arrives together')
    assert 'the stamps of the cameras are 37 s apart' in sentence
    line.pipeline.apply(replace(SETTINGS, pair_by='arrival'))
    stamps_apart(*apart, lambda: len(line.published) > 5, 'panoramas')
    assert line.published[-1][0] <= line.stamp_ns - 37 * 10**9, 'the older stamp'
    line.pipeline.apply(SETTINGS)
    line.feed(pictures, lambda: line.published[-1][0] > 0, 'pairs by stamp again')


def test_a_lens_that_changes_with_each_frame_stops_no_panorama(make_line, pictures):
    line = make_line()
    line.feed(pictures, lambda: line.published, 'a panorama')
    count = len(line.published)
    for index in range(1, 21):
        lens = replace(LENS, focal_x_px=LENS.focal_x_px + 0.01 * index)
        line.pipeline.place('left', lens, SETTINGS.surface_of(lens))
        line.feed(pictures, lambda seen=count + index: len(line.published) >= seen, 'the next one')
    assert line.pipeline.frames.unpaired_s < SETTINGS.stale_after_s


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
    make_line, pictures, monkeypatch
):
    line = make_line(replace(SETTINGS, stale_after_s=60.0))
    dark = {camera: np.zeros_like(picture) for camera, picture in pictures.items()}
    measure = compositor_builder.measure_overlaps
    is_measuring, resume = threading.Event(), threading.Event()

    def measure_late(*arguments):
        is_measuring.set()
        resume.wait(DEADLINE_S)
        return measure(*arguments)

    monkeypatch.setattr(compositor_builder, 'measure_overlaps', measure_late)
    line.feed(dark, is_measuring.is_set, 'a search')
    line.pipeline.apply(replace(SETTINGS, stale_after_s=60.0, crop='none', feather_deg=3.0))
    is_measuring.clear()
    resume.set()
    begin = time.monotonic()
    line.feed(dark, is_measuring.is_set, 'the next search')
    assert time.monotonic() - begin < 2.0, 'the pause between two searches'


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
