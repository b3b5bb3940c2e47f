"""Network streams, from a real HTTP camera."""

import errno
import time
from threading import Thread

import av
import pytest

from fisheye_capture import stream
from fisheye_capture.network_address import loss
from fisheye_capture.source import SourceLostError
from fisheye_capture.stream import StreamSource
from fisheye_core.errors import SourceError
from fisheye_testing.mjpeg_server import MjpegServer, jpeg

CODING_LOSS = 4
"""Grey levels by which JPEG may miss a plain picture."""


@pytest.fixture
def camera():
    server = MjpegServer(jpeg(90))
    yield server
    server.stop()


@pytest.fixture
def open_stream(settings):
    sources = []

    def open_it(url, **changes):
        changes = {'silence_timeout_s': 60.0, **changes}
        sources.append(StreamSource(settings(url, **changes)))
        return sources[-1]

    yield open_it
    for source in sources:
        source.close()


@pytest.mark.parametrize(('encoding', 'shape'), [('bgr8', (48, 64, 3)), ('mono8', (48, 64))])
def test_frames_come_with_the_time_at_which_they_came(camera, open_stream, encoding, shape):
    before_ns = time.time_ns()
    source = open_stream(camera.url, encoding=encoding)
    first, second = source.read(), source.read()
    assert first.image.shape == shape
    assert first.image.mean() == pytest.approx(90, abs=CODING_LOSS)
    assert before_ns < first.stamp_ns < second.stamp_ns <= time.time_ns()


@pytest.mark.parametrize(
    ('source', 'opened'),
    [
        ('http://user:p/w@rd@camera/a', 'http://user:p%2Fw%40rd@camera/a'),
        ('http://user:123%2Fx@camera/a', 'http://user:123%2Fx@camera/a'),
        ('http://camera:88/a?usr=me&pwd=p@ss', 'http://camera:88/a?usr=me&pwd=p@ss'),
        ('rtsp://camera:554/live/a@b', 'rtsp://camera:554/live/a@b'),
    ],
)
def test_only_user_and_password_are_quoted(settings, source, opened):
    assert stream.request_of(settings(source)).url == opened


def test_a_scheme_may_be_in_capitals(camera, open_stream):
    source = open_stream(camera.url.replace('http', 'HTTP'))
    assert source.read().size == (64, 48)


def test_stamps_go_back_only_with_the_clock_of_this_machine(camera, open_stream, monkeypatch):
    source, receive, back_ns = open_stream(camera.url), stream.receive, 0

    def receive_set_back(channel):
        message, files = receive(channel)
        if 'stamp_ns' in message:
            message['stamp_ns'] -= back_ns
        return message, files

    monkeypatch.setattr(stream, 'receive', receive_set_back)
    first_ns, back_ns = source.read().stamp_ns, 4_000_000_000
    assert source.read().stamp_ns == first_ns + 1
    back_ns = 3_600_000_000_000
    second_ns, third_ns = source.read().stamp_ns, source.read().stamp_ns
    assert second_ns < third_ns < first_ns


def test_without_pyav_it_is_said_what_to_install(open_stream, monkeypatch):
    monkeypatch.setattr(stream.importlib.util, 'find_spec', lambda name: None)
    with pytest.raises(SourceError, match='sudo apt install python3-av, or pip install av'):
        open_stream('http://127.0.0.1:1/stream')


def test_nobody_there_is_said_without_the_password(open_stream):
    source = open_stream('http://user:secret@127.0.0.1:1/stream')
    with pytest.raises(SourceLostError, match=r'^http://127\.0\.0\.1:1/stream refuses the'):
        source.read()


def test_a_camera_that_falls_silent_is_lost(camera, open_stream):
    source = open_stream(camera.url, silence_timeout_s=5.0)
    source.read()
    camera.stalled.set()
    with pytest.raises(SourceLostError, match='stopped sending pictures'):
        while True:
            source.read()


def test_a_camera_may_pause_for_longer_than_it_may_take_to_answer(camera, open_stream):
    source = open_stream(camera.url, connect_timeout_s=5.0)
    source.read()
    camera.stalled.set()
    time.sleep(6.0)
    camera.stalled.clear()
    paused_ns = time.time_ns()
    while source.read().stamp_ns < paused_ns:
        pass


def test_a_connection_that_breaks_off_is_said(camera, open_stream):
    source = open_stream(camera.url)
    source.read()
    camera.stop()
    # Whether that is an end or an error depends on the version of FFmpeg.
    said = 'the connection broke off|it ended the stream'
    with pytest.raises(SourceLostError, match=f'/stream stopped sending pictures: ({said})$'):
        while True:
            source.read()


@pytest.mark.parametrize(
    ('error', 'reason'),
    [
        (OSError(errno.EIO, 'Input/output error'), 'the connection broke off'),
        (ConnectionResetError(errno.ECONNRESET, 'Reset by peer'), 'Reset by peer'),
        (av.error.ExitError(0, 'Immediate exit'), 'nothing came for 3 s'),
    ],
)
def test_what_ends_a_camera_that_ran_is_said(settings, error, reason):
    request = stream.request_of(settings('http://camera/stream', frame_rate_hz=1.0))
    assert loss(request, error) == f'http://camera/stream stopped sending pictures: {reason}'


def test_a_read_that_waits_ends_at_once_when_interrupted(camera, open_stream):
    camera.stalled.set()
    source = open_stream(camera.url)
    ended = []

    def read():
        with pytest.raises(SourceLostError):
            source.read()
        ended.append(True)

    thread = Thread(target=read)
    thread.start()
    source.interrupt()
    thread.join(timeout=5)
    assert ended
