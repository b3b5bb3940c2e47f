"""Grabbing: frames while there are any, and a lost camera that comes back."""

import threading
from threading import Event

import pytest

from fisheye_capture import grabber as grabber_module
from fisheye_capture.grabber import Grabber
from fisheye_capture.source import Frame, Source, SourceEndedError, SourceLostError
from fisheye_core.errors import ImageFormatError, SourceError
from fisheye_testing.mjpeg_server import MjpegServer, jpeg


@pytest.fixture
def grab(settings):
    """Start a grabber; gives it with the list that its frames are added to."""
    grabbers = []

    def start(source, take=None, **changes):
        frames = []
        grabber = Grabber(settings(source, **changes), take or frames.append)
        grabbers.append(grabber)
        grabber.start()
        return grabber, frames

    yield start
    for grabber in grabbers:
        grabber.stop()


def test_it_hands_over_frames_and_knows_the_camera(grab, wait_until):
    grabber, frames = grab('synthetic', frame_rate_hz=50.0)
    wait_until(lambda: len(frames) > 10, 'frames')
    assert grabber.camera.lens.width == 640
    assert grabber.reason == ''
    wait_until(lambda: grabber.rate.hz == pytest.approx(50, rel=0.5), 'the rate')
    grabber.stop()
    assert len(frames) == grabber.frames


@pytest.mark.parametrize('source', ['nowhere.png', 'ftp://camera'])
def test_what_can_never_work_fails_at_start(settings, source):
    with pytest.raises(SourceError):
        Grabber(settings(source), print)


def test_a_camera_that_is_not_there_yet_is_waited_for(grab, wait_until):
    grabber, frames = grab('97', reconnect_max_s=0.1)
    wait_until(lambda: grabber.attempts > 2, 'further attempts')
    assert grabber.reason == 'there is no device /dev/video97'
    assert not frames


def test_an_http_camera_is_lost_and_comes_back(grab, wait_until):
    camera = MjpegServer(jpeg(90))
    grabber, frames = grab(camera.url, reconnect_max_s=0.3)
    wait_until(lambda: frames, 'the first frames')
    camera.stop()
    wait_until(lambda: grabber.reason, 'the loss')
    wait_until(lambda: grabber.attempts > 1, 'vain attempts')
    wait_until(lambda: 'refuses the connection' in grabber.reason, 'the reason')
    count = len(frames)
    camera = MjpegServer(jpeg(180), port=camera.port)
    wait_until(lambda: len(frames) > count, 'new frames')
    assert frames[count].image.mean() > 170
    wait_until(lambda: (grabber.reason, grabber.attempts) == ('', 0), 'the all-clear')
    camera.stop()


def test_a_camera_whose_pictures_are_refused_is_opened_anew(grab, wait_until):
    refuses = Event()
    refuses.set()

    def take(frame):
        if refuses.is_set():
            raise ImageFormatError('the picture has the wrong size')

    grabber, _ = grab('synthetic', take, reconnect_max_s=0.1)
    wait_until(lambda: grabber.attempts > 1, 'further attempts')
    assert (grabber.reason, grabber.frames) == ('the picture has the wrong size', 0)
    refuses.clear()
    wait_until(lambda: grabber.frames, 'frames')
    wait_until(lambda: (grabber.reason, grabber.attempts) == ('', 0), 'the all-clear')


def test_garbage_from_a_camera_is_never_handed_over(grab, wait_until):
    camera = MjpegServer(jpeg(90))
    grabber, frames = grab(camera.url, reconnect_max_s=0.3)
    wait_until(lambda: frames, 'the first frames')
    camera.picture = bytes(range(256)) * 20
    wait_until(lambda: grabber.reason, 'the loss')
    camera.picture = jpeg(90)
    wait_until(lambda: not grabber.reason, 'the return')
    assert all(abs(frame.image.mean() - 90) < 4 for frame in frames)
    camera.stop()


class Prepared(Source):
    """Source of prepared frames and errors."""

    def __init__(self, answers):
        self._answers = answers
        self.is_closed = False

    def read(self):
        answer = self._answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    def close(self):
        self.is_closed = True


def test_damage_is_told_of_a_camera_but_noted_of_files(grab, wait_until, write_picture, tmp_path):
    write_picture('folder/a.png', 1)
    (tmp_path / 'folder' / 'b.png').write_bytes(b'')
    grabber, _ = grab(tmp_path / 'folder')
    wait_until(lambda: grabber.damaged > 1, 'a second round')
    assert (grabber.reason, grabber.damage()) == ('', '')
    assert grabber.note.endswith('; such pictures are left out')


def test_damage_is_told_once(settings, monkeypatch):
    source = Prepared([])
    source.damaged = 3
    monkeypatch.setattr(grabber_module, 'open_source', lambda settings: source)
    grabber = Grabber(settings('any'), print)
    assert grabber.damage().startswith('3 pictures came damaged and were dropped, ')
    assert grabber.damage() == ''


def test_each_lost_source_is_closed_before_it_is_opened_again(grab, wait_until, monkeypatch):
    opened = [
        Prepared([Frame(1, None), SourceLostError('unplugged')]),
        Prepared([Frame(2, None), SourceEndedError('over')]),
    ]
    waiting = list(opened)
    monkeypatch.setattr(grabber_module, 'open_source', lambda settings: waiting.pop(0))
    grabber, frames = grab('any')
    wait_until(lambda: grabber.reason == 'over', 'the end')
    assert [frame.stamp_ns for frame in frames] == [1, 2]
    wait_until(lambda: all(source.is_closed for source in opened), 'the release')


def test_who_is_stopped_before_it_reads_releases_the_source(grab, wait_until, monkeypatch):
    stopped = Event()

    class LateThread(threading.Thread):
        def run(self):
            stopped.wait()
            super().run()

    source = Prepared([])
    source.interrupt = stopped.set
    monkeypatch.setattr(grabber_module, 'Thread', LateThread)
    monkeypatch.setattr(grabber_module, 'open_source', lambda settings: source)
    grabber, frames = grab('any')
    grabber.stop()
    wait_until(lambda: source.is_closed, 'the release')
    assert not frames


@pytest.mark.parametrize('source', ['97', 'http://127.0.0.1:1/', 'synthetic'])
def test_it_stops_in_every_state(grab, wait_until, source):
    grabber, _ = grab(source, frame_rate_hz=0.01, reconnect_max_s=3600.0)
    grabber.stop()
    wait_until(
        lambda: not [one for one in threading.enumerate() if one.name.startswith('grab ')],
        'the end of the thread',
    )


def test_changes_are_told(settings, wait_until, monkeypatch):
    waiting = [
        Prepared([Frame(1, None), SourceLostError('unplugged')]),
        Prepared([Frame(2, None), SourceEndedError('over')]),
    ]
    waiting[1].note = 'half as fast'
    monkeypatch.setattr(grabber_module, 'open_source', lambda settings: waiting.pop(0))
    told = []

    def tell(reason):
        told.append((grabber.news(reason), grabber.complaint))

    grabber = Grabber(settings('any'), lambda frame: None, on_change=tell)
    assert grabber.complaint == 'waiting for the first picture (attempts to reopen: 0)'
    grabber.start()
    wait_until(lambda: len(told) == 4, 'the end')
    grabber.stop()
    assert told == [
        ('pictures come', ''),
        ('no pictures: unplugged', 'unplugged (attempts to reopen: 0)'),
        ('pictures come; half as fast', ''),
        ('no pictures: over', 'over (attempts to reopen: 0)'),
    ]
