"""Pictures on disk: found, read as the sensor gave them, and named where they cannot be."""

import struct
from contextlib import suppress

import cv2
import numpy as np
import pytest

from fisheye_core.errors import SourceError
from fisheye_core.picture_file import SUFFIXES, is_picture, pictures_in, read_picture
from fisheye_testing.odd_pictures import huge_png, turned

PICTURE = np.full((48, 64, 3), (10, 20, 30), np.uint8)


@pytest.fixture
def folder(tmp_path):
    folder = tmp_path / 'rig [1]'
    folder.mkdir()
    for name in ('b.PNG', 'a.jpg', 'notes.txt', 'wave.mp4'):
        (folder / name).touch()
    return folder


def names(*arguments):
    return [path.name for path in pictures_in(*arguments)]


def test_a_folder_gives_its_pictures_in_order_whatever_its_name(folder):
    assert names(folder) == ['a.jpg', 'b.PNG']
    assert names(folder, SUFFIXES | {'.mp4'}) == ['a.jpg', 'b.PNG', 'wave.mp4']


def test_a_glob_gives_the_pictures_that_it_matches(folder):
    assert names(f'{folder.parent}/*/*') == names(f'{folder.parent}/**/*') == ['a.jpg', 'b.PNG']


@pytest.mark.parametrize('name', ['nowhere', 'x' * 300, '*.png', ''])
def test_what_is_not_there_gives_nothing(name):
    assert names(name) == []


@pytest.mark.parametrize('name', ['', '*.txt'])
def test_where_there_is_no_picture_it_is_said(tmp_path, name):
    (tmp_path / 'notes.txt').touch()
    with pytest.raises(SourceError, match=r'there is no picture in .*\(\.bmp, '):
        pictures_in(tmp_path / name)


@pytest.mark.parametrize('suffix', ['.png', '.bmp', '.tif', '.webp', '.ppm'])
def test_the_pixels_of_a_file(suffix, tmp_path):
    path = tmp_path / f'picture{suffix}'
    path.write_bytes(cv2.imencode(suffix, PICTURE, (cv2.IMWRITE_WEBP_QUALITY, 101))[1])
    assert is_picture(path)
    np.testing.assert_array_equal(read_picture(path), PICTURE)
    assert read_picture(path, grey=True).shape == (48, 64)


def test_a_picture_is_never_turned(tmp_path):
    (tmp_path / 'turned.jpg').write_bytes(turned(cv2.imencode('.jpg', PICTURE)[1].tobytes()))
    assert read_picture(tmp_path / 'turned.jpg').shape == (48, 64, 3)


@pytest.mark.parametrize('content', [b'', b'nothing like a picture', huge_png()], ids=len)
def test_a_file_that_is_no_picture_is_named(content, tmp_path):
    (tmp_path / 'odd.png').write_bytes(content)
    with pytest.raises(SourceError, match=r'odd\.png is not a picture that can be read'):
        read_picture(tmp_path / 'odd.png')


def claiming(suffix):
    """Return a file of a few bytes that claims to be larger than memory."""
    coded = bytearray(cv2.imencode(suffix, PICTURE)[1])
    at = {'.bmp': 18, '.jp2': coded.find(b'ihdr') + 4, '.ppm': 3, '.tif': -1}[suffix]
    if suffix == '.tif':  # TIFF 6.0, section 2: twelve bytes an entry, the value behind eight
        first = struct.unpack_from('<I', coded, 4)[0] + 2
        for entry in (first, first + 12):
            struct.pack_into('<HHII', coded, entry, coded[entry] | 0x100, 4, 1, 30_000)
    elif suffix == '.ppm':
        coded[at : at + 5] = b'30000 30000'
    else:
        struct.pack_into('<ii' if suffix == '.bmp' else '>ii', coded, at, 30_000, 30_000)
    return bytes(coded)


@pytest.mark.parametrize('suffix', ['.bmp', '.jp2', '.ppm', '.tif'])
def test_a_claim_that_no_camera_makes_is_refused_before_it_is_decoded(suffix, tmp_path):
    (tmp_path / f'huge{suffix}').write_bytes(claiming(suffix))
    with pytest.raises(SourceError, match='30000x30000 px; expected up to 50 million px'):
        read_picture(tmp_path / f'huge{suffix}')


@pytest.mark.parametrize('suffix', sorted(SUFFIXES - {'.jpeg', '.pbm', '.pgm', '.tiff'}))
def test_a_damaged_picture_is_read_or_refused(suffix, tmp_path):
    random = np.random.default_rng(1)
    whole = cv2.imencode(suffix, PICTURE)[1]
    for _ in range(200):
        damaged = whole[: random.integers(1, whole.size + 1)].copy()
        damaged[random.integers(0, min(damaged.size, 80), 3)] = random.integers(0, 256, 3)
        (tmp_path / f'odd{suffix}').write_bytes(damaged)
        with suppress(SourceError):
            assert read_picture(tmp_path / f'odd{suffix}').size <= 3 * 50_000_000


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(SourceError, match=r'nowhere\.png cannot be read: No such file'):
        read_picture(tmp_path / 'nowhere.png')
