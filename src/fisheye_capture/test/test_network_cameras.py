"""Real servers of every kind on loopback; each picture has the time of its making painted in."""

import subprocess
import sys
import time
from argparse import Namespace
from pathlib import Path

import numpy as np
import pytest

from fisheye_capture.source import SourceLostError
from fisheye_capture.stream import StreamSource
from fisheye_testing import network_camera
from fisheye_testing.http_camera import HttpServer
from fisheye_testing.painted_time import age_ms, read_image
from fisheye_testing.waiting import PATIENCE_S, wait_for

RATE_HZ = 20.0
PERIOD_MS = 1000 / RATE_HZ
PASSWORD = 'p/w@rd'
KINDS = {
    'rtsp': (['rtsp'], {}),
    'rtsp over udp': (['rtsp'], {'rtsp_transport': 'udp'}),
    'rtsp by the clock of the camera': (['rtsp'], {'stamp_from': 'camera'}),
    'rtsp jpeg': (['rtsp', '--codec', 'mjpeg'], {}),
    'transport stream': (['udp'], {}),
    'transport stream over http': (['ts'], {}),
    'multipart jpeg': (['mjpeg'], {}),
    'snapshot': (['snapshot'], {}),
}


@pytest.fixture
def camera():
    """Start a camera in a process of its own; give its address."""
    processes = []

    def start(*arguments):
        command = [sys.executable, network_camera.__file__, '--rate', str(RATE_HZ), *arguments]
        processes.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
        return processes[-1].stdout.readline().strip()

    start.processes = processes
    yield start
    for process in processes:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.fixture
def open_stream(settings):
    sources = []

    def open_it(url, **changes):
        changes = {'frame_rate_hz': RATE_HZ, 'silence_timeout_s': 60.0, **changes}
        sources.append(StreamSource(settings(url, **changes)))
        return sources[-1]

    yield open_it
    for source in sources:
        source.close()


def ages(source, count, pause_s=0.0):
    """Return the true and the told age of pictures, ms; nan where no time can be read."""
    true, told = [], []
    for _ in range(count):
        frame = source.read()
        now_ns = time.time_ns()
        painted_ms = read_image(frame.image)
        true.append(np.nan if painted_ms is None else age_ms(painted_ms, now_ns))
        told.append((now_ns - frame.stamp_ns) / 1e6)
        time.sleep(pause_s)
    return np.array(true), np.array(told)


@pytest.mark.parametrize('pause_s', [0.0, 0.12], ids=['', 'slow consumer'])
@pytest.mark.parametrize('kind', KINDS)
def test_the_age_that_is_told_is_the_true_one_and_does_not_grow(
    camera, open_stream, kind, pause_s
):
    arguments, changes = KINDS[kind]
    source = open_stream(camera(*arguments), **changes)
    ages(source, 5)
    before, _ = ages(source, 10, pause_s)

    def are_told_and_as_before():
        true, told = ages(source, 20, pause_s)
        assert not np.isnan(true).any()
        return (
            abs(np.median(true - told)) < PERIOD_MS
            and np.median(true[-10:]) < np.median(before) + 2 * PERIOD_MS
        )

    # Other work on the machine ends some time; a delay that has grown stays.
    wait_for(are_told_and_as_before, PATIENCE_S, 'ages that are told')


def test_a_playlist_comes_at_its_own_rate(camera, open_stream):
    """What a playlist delays, nobody can tell; but it does not come by the second."""
    url = camera('hls')
    deadline_s = time.monotonic() + 30
    while True:
        source = open_stream(url)
        try:
            source.read()
            break
        except SourceLostError:
            assert time.monotonic() < deadline_s, 'no segment was written'

    def is_at_its_rate():
        stamps_ns = [source.read().stamp_ns for _ in range(40)]
        return np.median(np.diff(stamps_ns)) / 1e6 == pytest.approx(PERIOD_MS, rel=0.3)

    wait_for(is_at_its_rate, PATIENCE_S, 'its rate')


def test_a_keyframe_each_10_s_is_enough_where_the_first_comes_at_once(camera, open_stream):
    true, _ = ages(open_stream(camera('rtsp', '--gop', '10')), 20)
    assert not np.isnan(true).any()


def test_a_keyframe_that_does_not_come_is_said(camera, open_stream):
    url = camera('rtsp', '--gop', '600', '--join-late')
    source = open_stream(url, silence_timeout_s=4.0, first_picture_timeout_s=9.0)
    with pytest.raises(SourceLostError, match=r'but no whole keyframe for \d+ s; set its GOP'):
        for _ in range(300):
            source.read()
    assert 'no whole keyframe' in source.note


UNTOLD = 10
"""FFmpeg does not tell of every lost packet: pictures up to the next keyframe, half a second."""


@pytest.mark.parametrize('kind', ['rtsp', 'udp'])
def test_what_came_damaged_is_dropped_and_counted(camera, open_stream, kind):
    source = open_stream(camera(kind, '--loss', '0.01', '--gop', '0.5'))
    true, _ = ages(source, 60)
    assert np.isnan(true).sum() <= UNTOLD
    assert source.damaged > 0


def test_torn_jpegs_are_dropped_and_counted(camera, open_stream):
    source = open_stream(camera('mjpeg', '--loss', '0.3'))
    true, _ = ages(source, 40)
    assert not np.isnan(true).any()
    assert source.damaged > 0


@pytest.mark.parametrize('arguments', [['mjpeg'], ['snapshot'], ['rtsp', '--codec', 'mjpeg']])
def test_the_jpeg_of_a_camera_is_passed_on(camera, open_stream, arguments):
    frame = open_stream(camera(*arguments)).read()
    assert bytes(frame.jpeg[:2]) == b'\xff\xd8'
    assert 'image' not in vars(frame)
    assert frame.size == (640, 480)


def test_in_grey_a_jpeg_is_decoded(camera, open_stream):
    frame = open_stream(camera('mjpeg'), encoding='mono8').read()
    assert (frame.jpeg, frame.image.shape) == (None, (480, 640))


def test_what_a_lost_camera_left_in_the_decoder_is_not_shown(camera, open_stream):
    source = open_stream(camera('udp'), silence_timeout_s=5.0)
    ages(source, 10)
    camera.processes[0].kill()
    true = []
    with pytest.raises(SourceLostError, match='stopped sending pictures'):
        while True:
            true += list(ages(source, 1)[0])
    assert all(age < 4500 for age in true)


def test_the_delay_of_a_camera_is_taken_off(camera, open_stream):
    source = open_stream(camera('mjpeg'), delay_ms=3000.0)
    true, told = ages(source, 10)
    assert np.median(told - true) == pytest.approx(3000, abs=PERIOD_MS)


@pytest.mark.parametrize('kind', ['rtsp', 'mjpeg', 'snapshot'])
def test_a_password_may_hold_any_letter_and_is_never_shown(camera, open_stream, kind):
    url = camera(kind, '--password', PASSWORD)
    right = url.replace('://', f'://user:{PASSWORD}@')
    assert open_stream(right).read().size == (640, 480)
    for wrong in (url, url.replace('://', '://user:wr/ong@')):
        with pytest.raises(SourceLostError) as refused:
            open_stream(wrong).read()
        assert str(refused.value) == f'{url} refuses the user or password (401)'


@pytest.mark.parametrize(
    ('kind', 'path', 'sentence'),
    [
        ('rtsp', 'nothing', 'has no such path (404)'),
        ('mjpeg', 'nothing', 'has no such path (404)'),
        ('mjpeg', 'redirect', 'leads to what a camera may not lead to'),
    ],
)
def test_what_an_address_leads_to_is_said(camera, open_stream, kind, path, sentence):
    url = camera(kind, '--redirect', f'file://{Path(__file__)}').rpartition('/')[0]
    with pytest.raises(SourceLostError) as refused:
        open_stream(f'{url}/{path}').read()
    assert str(refused.value).startswith(f'{url}/{path} {sentence}')


def test_a_redirect_to_another_camera_is_followed(camera, open_stream):
    url = camera('mjpeg', '--redirect', camera('mjpeg'))
    assert open_stream(url.replace('stream', 'redirect')).read().size == (640, 480)


@pytest.mark.parametrize(
    ('url', 'sentence'),
    [
        ('http://127.0.0.1:1/x', 'refuses the connection'),
        ('rtsp://127.0.0.1:1/x', 'refuses the connection'),
        ('rtsp://camera.invalid/x', 'cannot be found; is the name of the host right?'),
        ('udp://127.0.0.1:61999', 'gave no picture data within 1 s'),
    ],
)
def test_who_is_not_there_is_named(open_stream, url, sentence):
    with pytest.raises(SourceLostError) as refused:
        open_stream(url, connect_timeout_s=1.0 if url.startswith('udp') else 10.0).read()
    assert str(refused.value).startswith(f'{url} {sentence}')


def test_a_playlist_cannot_read_files_of_this_machine(open_stream, tmp_path):
    secret = tmp_path / 'secret.ts'
    secret.write_bytes(b'G' * 10_000)
    playlist = tmp_path / 'live.m3u8'
    playlist.write_text(f'#EXTM3U\n#EXT-X-TARGETDURATION:1\n#EXTINF:1,\nfile://{secret}\n')
    served = HttpServer(Namespace(port=0, password=''), folder=str(tmp_path))
    with pytest.raises(SourceLostError):
        open_stream(f'{served.address}/live.m3u8', connect_timeout_s=2.0).read()
