"""Pictures, folders and videos: held, in turn, looped; what cannot be read is named."""

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


def test_a_folder_of_different_sizes_names_the_first_that_differs(
    settings, write_picture, tmp_path
):
    write_picture('folder/a.png', 1)
    write_picture('folder/b.png', 1, width=40)
    source = open_source(settings(tmp_path / 'folder'))
    source.read()
    with pytest.raises(SourceError, match=r'b\.png has 40x24 px.*have 32x24 px'):
        source.read()


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


def test_an_unreadable_picture_in_a_folder_is_named(settings, write_picture, tmp_path):
    write_picture('folder/a.png', 1)
    (tmp_path / 'folder' / 'b.png').write_bytes(b'')
    source = open_source(settings(tmp_path / 'folder'))
    source.read()
    with pytest.raises(SourceError, match=r'b\.png is not a picture'):
        source.read()
