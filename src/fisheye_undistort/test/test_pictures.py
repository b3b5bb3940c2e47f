import re

import cv2
import numpy as np
import pytest

from fisheye_core.errors import SourceError
from fisheye_testing.odd_pictures import huge_png, turned
from fisheye_undistort.detect.pictures import read_pictures

HEIC = b'\0\0\0\x18ftypheic\0\0\0\0mif1heic'
FLOAT = cv2.imencode('.tif', np.linspace(0, 1, 48, dtype=np.float32).reshape(6, 8))[1].tobytes()


def grey(value, width=64, height=48):
    return np.full((height, width), value, np.uint8)


def names(*paths, half=''):
    return [picture.name for picture in read_pictures(paths, half)]


@pytest.fixture
def folder(tmp_path):
    for value in (30, 10, 20):
        cv2.imwrite(str(tmp_path / f'shot{value}.png'), grey(value))
    (tmp_path / 'notes.txt').write_text('no picture')
    return tmp_path


def test_a_folder_gives_its_pictures_in_order(folder):
    assert names(folder) == ['shot10.png', 'shot20.png', 'shot30.png']


def test_globs_and_files_go_together(folder):
    assert names(folder / 'shot30.png', f'{folder}/*1*.png') == ['shot30.png', 'shot10.png']


def test_colour_becomes_grey(tmp_path):
    cv2.imwrite(str(tmp_path / 'red.png'), np.full((4, 6, 3), (0, 0, 200), np.uint8))
    (picture,) = read_pictures([tmp_path / 'red.png'])
    assert picture.gray.shape == (4, 6)
    assert picture.gray.dtype == np.uint8


def test_pixels_come_as_the_sensor_gave_them_whatever_exif_says(tmp_path):
    coded = cv2.imencode('.jpg', grey(90))[1].tobytes()
    (tmp_path / 'turned.jpg').write_bytes(turned(coded))
    (picture,) = read_pictures([tmp_path / 'turned.jpg'])
    assert picture.gray.shape == (48, 64)


@pytest.mark.parametrize(('half', 'value'), [('left', 10), ('right', 200)])
def test_halves_of_a_side_by_side_picture(half, value, tmp_path):
    cv2.imwrite(str(tmp_path / 'both.png'), np.hstack([grey(10), grey(200)]))
    (picture,) = read_pictures([tmp_path / 'both.png'], half)
    assert picture.gray.shape == (48, 64)
    assert np.all(picture.gray == value)


def test_a_video_gives_ten_frames_a_second(tmp_path):
    path = tmp_path / 'wave.avi'
    video = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*'MJPG'), 30, (64, 48), False)
    for value in range(30):
        video.write(grey(8 * value))
    video.release()
    pictures = list(read_pictures([path]))
    assert len(pictures) == 10
    assert all(picture.moving for picture in pictures)
    assert pictures[3].name == 'wave.avi frame 9'
    assert abs(pictures[3].gray.mean() - 72) < 8


@pytest.mark.parametrize(
    ('name', 'content', 'told'),
    [
        ('broken.png', b'nothing like a picture', 'broken.png is not a picture'),
        ('empty.jpg', b'', 'empty.jpg is not a picture'),
        ('huge.png', huge_png(), 'huge.png is not a picture'),
        ('broken.mp4', b'nothing like a video', 'broken.mp4 is not a video'),
        ('phone.heic', HEIC, 'phone.heic is not a picture that can be read: it is HEIC'),
        ('float.tif', FLOAT, 'float.tif is not .* its pixels are float32; expected whole numbers'),
    ],
    ids=lambda value: value if isinstance(value, str) else '',
)
def test_what_cannot_be_read_is_named_and_the_rest_is_read(name, content, told, folder):
    (folder / name).write_bytes(content)
    pictures = list(read_pictures([folder]))
    problems = [picture for picture in pictures if picture.problem]
    assert [picture.name for picture in problems] == [name]
    assert re.search(told, problems[0].problem)
    assert len(pictures) == 4


@pytest.mark.parametrize('name', ['missing.png', 'x' * 300])
def test_what_is_not_there_is_an_error(name, tmp_path):
    with pytest.raises(SourceError, match='is not there'):
        list(read_pictures([tmp_path / name]))


def test_a_folder_without_pictures(tmp_path):
    with pytest.raises(SourceError, match='there is no picture in'):
        list(read_pictures([tmp_path]))
