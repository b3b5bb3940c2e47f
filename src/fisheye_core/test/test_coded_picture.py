"""Sizes of coded pictures, against those that OpenCV coded."""

import cv2
import numpy as np
import pytest

from fisheye_core.coded_picture import decoded, size_of, whole_jpeg
from fisheye_core.errors import ImageFormatError
from fisheye_testing.odd_pictures import turned

PICTURE = np.random.default_rng(1).integers(0, 256, (37, 53, 3), np.uint8)


@pytest.mark.parametrize('suffix', ['.jpg', '.png'])
@pytest.mark.parametrize(
    'options', [(), (cv2.IMWRITE_JPEG_PROGRESSIVE, 1), (cv2.IMWRITE_JPEG_RST_INTERVAL, 2)]
)
@pytest.mark.parametrize('image', [PICTURE, PICTURE[..., 0]], ids=['color', 'grey'])
def test_the_size_is_in_the_head(suffix, options, image):
    coded = cv2.imencode(suffix, image, options if suffix == '.jpg' else ())[1]
    assert size_of(coded) == (53, 37)


def test_bytes_that_fill_up_are_skipped():
    coded = cv2.imencode('.jpg', PICTURE)[1].tobytes()
    filled = coded[:2] + b'\xff\xff\xff' + coded[2:]
    assert size_of(np.frombuffer(filled, np.uint8)) == (53, 37)


@pytest.mark.parametrize('suffix', ['.jpg', '.png', '.bmp'])
def test_what_ends_too_early_or_is_something_else_is_refused(suffix):
    coded = cv2.imencode(suffix, PICTURE)[1]
    for count in range(0, 24):
        with pytest.raises(
            ImageFormatError, match=f'{count} bytes are not an image; expected JPEG'
        ):
            size_of(coded[:count])


@pytest.mark.parametrize('grey', [False, True])
def test_pixels_come_as_the_sensor_gave_them_whatever_exif_says(grey):
    coded = cv2.imencode('.jpg', PICTURE)[1]
    exif = np.frombuffer(turned(coded.tobytes()), np.uint8)
    assert cv2.imdecode(exif, cv2.IMREAD_COLOR).shape[:2] == (53, 37), 'others turn it'
    assert size_of(exif) == (53, 37)
    np.testing.assert_array_equal(decoded(exif, grey=grey), decoded(coded, grey=grey))


def test_a_picture_that_is_not_as_large_as_it_claims_is_refused():
    coded = cv2.imencode('.jpg', PICTURE)[1].tobytes()
    # Decoders know that a restart marker has no length; what is skipped by one is the picture.
    claim = b'\xff\xc0\0\x0b\x08\0\x08\0\x10\x01\x01\x11\0'
    hidden = b'\xff\xd0' + len(coded).to_bytes(2, 'big') + coded[2:]
    false = np.frombuffer(coded[:2] + hidden + claim, np.uint8)
    assert size_of(false) == (16, 8)
    with pytest.raises(ImageFormatError, match='a picture of 53x37 px claims 16x8 px'):
        decoded(false)


def test_a_jpeg_ends_where_it_says():
    coded = cv2.imencode('.jpg', PICTURE)[1].ravel()
    padded = np.append(coded, np.zeros(100, np.uint8))
    np.testing.assert_array_equal(whole_jpeg(padded), coded)
    assert whole_jpeg(coded[:-10]) is None
    np.testing.assert_array_equal(decoded(padded), cv2.imdecode(coded, cv2.IMREAD_COLOR))


def test_the_end_of_a_thumbnail_is_not_that_of_its_picture():
    coded = cv2.imencode('.jpg', PICTURE)[1].tobytes()
    segment = b'\xff\xe1' + (len(coded) + 2).to_bytes(2, 'big') + coded
    whole = np.frombuffer(coded[:2] + segment + coded[2:], np.uint8)
    np.testing.assert_array_equal(whole_jpeg(whole), whole)
    assert whole_jpeg(whole[:-10]) is None
    assert whole_jpeg(whole[:40]) is None
