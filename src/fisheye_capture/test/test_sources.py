"""What a source's name means, and what is said of one that means nothing."""

import os
from contextlib import closing

import numpy as np
import pytest

from fisheye_capture.scene import Scene
from fisheye_capture.source import SourceLostError, shown_source
from fisheye_capture.sources import SOURCES, kind_of, open_source
from fisheye_core.errors import SourceError
from fisheye_geometry.attitude import Attitude


def test_the_synthetic_camera_is_known_exactly(settings):
    source = open_source(settings(synthetic_fov_deg=160.0))
    camera, frame = source.camera, source.read()
    assert camera.name == 'left'
    assert frame.image.shape == (camera.lens.height, camera.lens.width, 3) == (480, 640, 3)


def test_the_synthetic_camera_can_be_mounted_in_any_way(settings):
    angles_deg = (100.0, -12.0, 180.0)
    names = ('synthetic_yaw_deg', 'synthetic_pitch_deg', 'synthetic_roll_deg')
    angles = dict(zip(names, angles_deg, strict=True))
    source = open_source(settings(width=160, height=120, **angles))
    frame = source.read()
    attitude = Attitude(*np.radians(angles_deg))
    expected = Scene().view(source.camera.lens, attitude).frame(frame.stamp_ns)
    assert (frame.image == expected).all()


def test_cameras_of_one_rate_share_a_grid_of_times(settings, write_picture):
    period_ns = 5_000_000
    for name in ('synthetic', write_picture('one.png', 7)):
        source = open_source(settings(name, frame_rate_hz=200.0))
        assert all(source.read().stamp_ns % period_ns == 0 for _ in range(5))


@pytest.mark.parametrize('name', ['0', '12', '/dev/video3', '/dev/v4l/by-id/usb-left'])
def test_devices(name):
    assert kind_of(name) == 'device'


@pytest.mark.parametrize('scheme', ['http', 'https', 'rtsp', 'rtsps', 'udp', 'RTSP'])
def test_streams(scheme):
    assert kind_of(f'{scheme}://camera/stream') == 'stream'


@pytest.fixture
def names(tmp_path, write_picture, video):
    return {
        'synthetic': 'synthetic',
        'device': '97',
        'stream': 'http://127.0.0.1:1/stream',
        'picture': str(write_picture('one.png', 7)),
        'video': str(video),
        'pictures': str(tmp_path / '*.png'),
    }


@pytest.mark.parametrize('kind', SOURCES)
def test_a_name_means_one_kind(names, kind):
    assert [each for each in SOURCES if SOURCES[each].recognises(names[kind])] == [kind]
    assert kind_of(names[kind]) == kind


@pytest.mark.parametrize('kind', SOURCES)
def test_each_kind_gives_frames_or_says_that_it_may(settings, names, kind):
    try:
        with closing(open_source(settings(names[kind]))) as source:
            assert source.read().size > (0, 0)
    except SourceLostError:
        assert kind in ('device', 'stream')  # neither camera is there


def test_a_file_url_is_a_file(settings, write_picture):
    path = write_picture('one.png', 7)
    assert (open_source(settings(f'file://{path}')).read().image == 7).all()


def test_an_unknown_scheme_is_refused_with_those_that_are_known(settings):
    with pytest.raises(SourceError, match=r"scheme 'ftp'; expected one of http, .*udp or file"):
        open_source(settings('ftp://camera'))


@pytest.mark.parametrize(
    ('source', 'shown'),
    [
        ('rtsp://user:secret@camera:554/live', 'rtsp://camera:554/live'),
        ('http://camera/live@2x', 'http://camera/live@2x'),
        ('rtsp://user:p/w@rd@host:554/live', 'rtsp://host:554/live'),
        ('rtsp://user@host/live', 'rtsp://host/live'),
        ('http://host/mjpg?user=me&pwd=secret&size=2', 'http://host/mjpg?user=***&pwd=***&size=2'),
        ('rtsp://host/user=me_password=secret_channel=1', 'rtsp://host/user=***'),
        ('http://host/a.cgi?Token=abc', 'http://host/a.cgi?Token=***'),
        ('rtsp://user:12@34/5@host/live', 'rtsp://host/live'),
        ('rtsp://user:554@host/live', 'rtsp://host/live'),
        ('rtsp://camera:554/live/a@b', 'rtsp://camera:554/live/a@b'),
        ('http://[fe80::1]:88/a@b', 'http://[fe80::1]:88/a@b'),
        ('http://user:secret@[fe80::1]:88/a', 'http://[fe80::1]:88/a'),
        ('http://10.0.0.9:88/x?usr=me&pwd=p@ss&n=2', 'http://10.0.0.9:88/x?usr=***&pwd=***&n=2'),
        ('http://10.0.0.9:88?pwd=p@ss', 'http://10.0.0.9:88?pwd=***'),
        ('http://host/a?jwt=abc&sig=de/f==&n=2', 'http://host/a?jwt=***&sig=***&n=2'),
        ('http://host/a?code=1&hash=2&cnonce=3', 'http://host/a?code=***&hash=***&cnonce=***'),
        ('http://host/a?codec=h264&pwd=a;b#c/d', 'http://host/a?codec=h264&pwd=***'),
        ('user:secret@host', 'host'),
        ('rig//left@home.png', 'rig//left@home.png'),
    ],
)
def test_a_source_is_shown_without_its_password(source, shown):
    assert shown_source(source) == shown


def test_a_refusal_does_not_tell_the_password(settings):
    with pytest.raises(SourceError, match="source 'ftp://camera' has the scheme"):
        open_source(settings('ftp://user:secret@camera'))


def test_a_typing_error_does_not_tell_the_password(settings):
    with pytest.raises(SourceError, match="source 'rtsp:/host/live' is not there"):
        open_source(settings('rtsp:/user:secret@host/live'))


@pytest.mark.parametrize('name', ['pipe.png', 'pipe.mp4', 'zero.png'])
def test_what_never_ends_is_named(settings, tmp_path, name):
    path = tmp_path / name
    if name == 'zero.png':
        path.symlink_to('/dev/zero')
    else:
        os.mkfifo(path)
    with pytest.raises(SourceError, match=f'{name} is not a regular file; expected a picture'):
        open_source(settings(path))


def test_a_fifo_in_a_folder_is_named(settings, tmp_path):
    os.mkfifo(tmp_path / 'a.png')
    with pytest.raises(SourceError, match=r'a\.png is not a regular file'):
        open_source(settings(tmp_path))


@pytest.mark.parametrize('name', ['nowhere.png', 'nowhere/*.png', '', '~no_such_user/x'])
def test_what_is_not_there_is_named(settings, name):
    with pytest.raises(SourceError, match='is not there; expected synthetic, a device'):
        open_source(settings(name))


def test_an_empty_folder_is_named(settings, tmp_path):
    with pytest.raises(SourceError, match=f'no picture in {tmp_path}'):
        open_source(settings(tmp_path))


def test_pictures_that_vanish_before_they_are_opened_are_named(settings, tmp_path):
    with pytest.raises(SourceError, match=r"the pictures of '.*\*\.png' are not there any more"):
        SOURCES['pictures'].open(settings(tmp_path / '*.png'))


def test_a_device_that_is_not_there_may_come(settings):
    with pytest.raises(SourceLostError, match='there is no device /dev/video97'):
        open_source(settings('97'))
