"""Pictures, folders and videos: held, in turn, looped; what cannot be read is named."""

import re

import cv2
import numpy as np
import pytest

from fisheye_capture.source import SourceEndedError
from fisheye_capture.sources import open_source
from fisheye_core.errors import SourceError
from fisheye_testing.odd_pictures import huge_png, turned_video

CODING_LOSS = 6
"""Grey levels by which a video's coding may miss a plain picture."""


def levels(source, count):
    return [int(source.read().image[0, 0, 0]) for _ in range(count)]


def test_a_picture_is_decoded_once_and_held(settings, write_picture):
    source = open_source(settings(write_picture('one.png', 7)))
    first, second = source.read(), source.read()
    assert first.image is second.image
    assert not first.image.flags.writeable
    assert second.stamp_ns > first.stamp_ns
    assert (first.image == 7).all()


@pytest.mark.parametrize(
    ('encoding', 'pixel'), [('bgr8', [10, 20, 30]), ('rgb8', [30, 20, 10]), ('mono8', 22)]
)
def test_pictures_come_in_the_encoding_asked_for(settings, tmp_path, encoding, pixel):
    path = tmp_path / 'colour.png'
    cv2.imwrite(str(path), np.full((4, 6, 3), (10, 20, 30), np.uint8))
    image = open_source(settings(path, encoding=encoding)).read().image
    np.testing.assert_array_equal(image[0, 0], pixel)


def test_a_grey_picture_of_16_bit_becomes_8_bit(settings, tmp_path):
    path = tmp_path / 'deep.png'
    cv2.imwrite(str(path), np.full((4, 6), 200 * 256, np.uint16))
    assert open_source(settings(path)).read().image[0, 0].tolist() == [200, 200, 200]


def test_a_folder_is_shown_in_name_order_and_again(settings, write_picture, tmp_path):
    for name, level in (('b.png', 2), ('a.png', 1), ('c.png', 3)):
        write_picture(f'folder/{name}', level)
    (tmp_path / 'folder' / 'notes.txt').write_text('no picture')
    assert levels(open_source(settings(tmp_path / 'folder')), 4) == [1, 2, 3, 1]


def test_a_glob_takes_what_matches(settings, write_picture, tmp_path):
    for name, level in (('left_1.png', 1), ('right_1.png', 9), ('left_2.png', 2)):
        write_picture(name, level)
    assert levels(open_source(settings(tmp_path / 'left_*.png')), 3) == [1, 2, 1]


def test_without_loop_the_end_is_the_end(settings, write_picture, tmp_path):
    write_picture('folder/only.png', 1)
    source = open_source(settings(tmp_path / 'folder', loop=False))
    source.read()
    with pytest.raises(SourceEndedError, match='last picture'):
        source.read()


@pytest.fixture
def folder(write_picture, tmp_path):
    """Write pictures of levels 1, 2 ...; those of kind x are unreadable, those of kind o wider."""

    def write(*kinds):
        (tmp_path / 'folder').mkdir()
        for number, kind in enumerate(kinds, 1):
            name = f'folder/{number}.png'
            if kind == 'x':
                (tmp_path / name).write_bytes(b'')
            else:
                write_picture(name, number, width=40 if kind == 'o' else 32)
        return tmp_path / 'folder'

    return write


@pytest.mark.parametrize(
    ('kind', 'fault'),
    [
        ('x', r'2\.png is not a picture that can be read: .*'),
        ('o', r'2\.png has 40x24 px; the pictures before it have 32x24 px'),
    ],
)
def test_a_picture_that_cannot_be_shown_is_left_out_and_said_once(settings, folder, kind, fault):
    source = open_source(settings(folder('', kind, '', kind)))
    assert source.note == ''
    assert levels(source, 5) == [1, 3, 1, 3, 1]
    assert source.damaged == 4
    assert re.fullmatch(f'.*{fault}; such pictures are left out', source.note)


def test_after_a_picture_that_cannot_be_shown_the_rest_comes_once_without_loop(settings, folder):
    source = open_source(settings(folder('x', '', 'x', '', 'o'), loop=False))
    assert levels(source, 2) == [2, 4]
    with pytest.raises(SourceEndedError, match='last picture'):
        source.read()


def test_the_time_of_a_picture_that_cannot_be_shown_passes(settings, folder):
    """So two cameras keep step."""
    source = open_source(settings(folder('x', '', 'x', ''), frame_rate_hz=20.0))
    first_ns, second_ns = source.read().stamp_ns, source.read().stamp_ns
    assert second_ns - first_ns >= 2 * 50_000_000


def test_a_folder_without_a_picture_that_can_be_shown_names_the_first(settings, folder):
    with pytest.raises(SourceError, match=r'1\.png is not a picture'):
        open_source(settings(folder('x', 'x')))


def test_pictures_that_vanish_later_are_an_error(settings, folder):
    path = folder('', '')
    source = open_source(settings(path))
    levels(source, 2)
    for picture in path.iterdir():
        picture.unlink()
    with pytest.raises(SourceError, match=r'1\.png cannot be read: No such file'):
        levels(source, 2)


def test_a_video_is_paced_and_looped(settings, video):
    source = open_source(settings(video))
    assert levels(source, 5) == pytest.approx([50, 100, 150, 50, 100], abs=CODING_LOSS)
    assert source.read().stamp_ns % 5_000_000 == 0


def test_a_video_without_loop_ends(settings, video):
    source = open_source(settings(video, loop=False))
    assert len(levels(source, 3)) == 3
    with pytest.raises(SourceEndedError):
        source.read()


@pytest.mark.parametrize('name', ['broken.png', 'broken.mp4', 'text.txt'])
def test_a_file_that_is_no_picture_is_named(settings, tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b'this is not a picture')
    with pytest.raises(SourceError, match=name):
        open_source(settings(path))


@pytest.mark.parametrize('side_px', [30_000, 60_000])
def test_a_picture_of_absurd_size_is_named(settings, tmp_path, side_px):
    path = tmp_path / 'huge.png'
    path.write_bytes(huge_png(side_px))
    with pytest.raises(SourceError, match=rf'huge\.png .* {side_px}x{side_px} px; expected up to'):
        open_source(settings(path))


def test_a_file_of_absurd_size_is_named(settings, tmp_path):
    path = tmp_path / 'huge.bmp'
    with path.open('wb') as file:
        file.truncate(10**12)
    with pytest.raises(SourceError, match=r'huge\.bmp has 1000000 MB; expected a picture of up'):
        open_source(settings(path))


def test_a_video_is_not_turned_whatever_it_says(settings, tmp_path):
    path = tmp_path / 'turned.mp4'
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'mp4v'), 25, (64, 48))
    for _ in range(3):
        writer.write(np.full((48, 64, 3), 90, np.uint8))
    writer.release()
    path.write_bytes(turned_video(path.read_bytes()))
    assert cv2.VideoCapture(str(path)).read()[1].shape == (64, 48, 3), 'others turn it'
    assert open_source(settings(path)).read().image.shape == (48, 64, 3)
