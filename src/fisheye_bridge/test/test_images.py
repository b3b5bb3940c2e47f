"""Images: every encoding, padding, no copy where none is needed, and nonsense refused."""

from array import array

import cv2
import numpy as np
import pytest
from sensor_msgs.msg import CompressedImage, Image
from std_msgs.msg import Header

from fisheye_bridge.images import (
    ImageBuffer,
    from_jpeg,
    to_array,
    to_jpeg,
)
from fisheye_core.encodings import CHANNELS, converted
from fisheye_core.errors import ImageFormatError
from fisheye_testing.image_message import to_message

COLORS = np.zeros((8, 12, 3), np.uint8)
COLORS[:, :6] = (200, 90, 40)
COLORS[:, 6:] = (30, 180, 220)
CHROMA_LEVELS = 6
"""Conversion to YUV and back rounds twice."""


def message_of(pixels, encoding, padding=0):
    rows = pixels.reshape(len(pixels), -1)
    padded = np.pad(rows, ((0, 0), (0, padding)), constant_values=99)
    channels = pixels.shape[2] if pixels.ndim == 3 else 1
    message = Image(
        width=rows.shape[1] // channels,
        height=len(rows),
        encoding=encoding,
        step=padded.shape[1] * pixels.itemsize,
        is_bigendian=pixels.dtype.byteorder == '>',
    )
    message.data.frombytes(padded.tobytes())
    return message


def mosaic(pattern, depth=np.uint8):
    """Sample COLORS through a Bayer pattern named by its first two rows."""
    out = np.empty(COLORS.shape[:2], depth)
    for index, color in enumerate(pattern):
        y, x = divmod(index, 2)
        out[y::2, x::2] = COLORS[y::2, x::2, 'bgr'.index(color)]
    return out


def yuv(order):
    """Pack COLORS as 4:2:2."""
    y, u, v = cv2.split(cv2.cvtColor(COLORS, cv2.COLOR_BGR2YUV))
    # OpenCV's plain YUV is full range; cameras send luma 16 to 235 and chroma scaled alike.
    y, u, v = 16 + y * (219 / 255), *(128 + (c - 128.0) * s for c, s in ((u, 1.02), (v, 0.81)))
    packed = np.empty((*y.shape, 2), np.uint8)
    chroma, luma = (1, 0) if order == 'yuyv' else (0, 1)
    packed[..., luma] = np.rint(y)
    packed[:, 0::2, chroma] = np.rint(u[:, 0::2])
    packed[:, 1::2, chroma] = np.rint(v[:, 0::2])
    return packed


@pytest.mark.parametrize('padding', [0, 3, 5])
@pytest.mark.parametrize(
    ('encoding', 'same'),
    [*((each, each) for each in CHANNELS), ('8UC3', 'bgr8'), ('8UC1', 'mono8')],
)
def test_encodings_of_bytes_are_the_messages_own_memory(encoding, same, padding):
    pixels = COLORS[..., 0] if same == 'mono8' else COLORS
    message = message_of(pixels, encoding, padding)
    array, name = to_array(message)
    assert name == same
    assert (array == pixels).all()
    assert np.shares_memory(array, np.frombuffer(message.data, np.uint8))


@pytest.mark.parametrize('padding', [0, 3])
@pytest.mark.parametrize('encoding', ['bgra8', 'rgba8'])
def test_alpha_is_dropped(encoding, padding):
    pixels = cv2.cvtColor(
        COLORS, cv2.COLOR_BGR2BGRA if encoding == 'bgra8' else cv2.COLOR_BGR2RGBA
    )
    array, name = to_array(message_of(pixels, encoding, padding))
    assert name == 'bgr8'
    assert (array == COLORS).all()


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
def test_bayer_patterns_give_the_colors_back(pattern):
    array, name = to_array(message_of(mosaic(pattern), f'bayer_{pattern}8', padding=2))
    assert name == 'bgr8'
    assert (array[2:-2, 2:4] == COLORS[2:-2, 2:4]).all()
    assert (array[2:-2, -4:-2] == COLORS[2:-2, -4:-2]).all()


@pytest.mark.parametrize('padding', [0, 3])
@pytest.mark.parametrize('order', ['<u2', '>u2'])
def test_of_sixteen_bits_the_upper_eight_are_shown(order, padding):
    levels = np.linspace(0, 65535, 96).reshape(8, 12)
    array, name = to_array(message_of(levels.astype(order), 'mono16', padding))
    assert name == 'mono8'
    np.testing.assert_array_equal(array, levels.astype(int) // 256)


@pytest.mark.parametrize('order', ['<u2', '>u2'])
@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
def test_bayer_patterns_of_sixteen_bits_give_the_colors_back(pattern, order):
    sensor = (mosaic(pattern, np.uint16) * 256 + 77).astype(order)
    array, name = to_array(message_of(sensor, f'bayer_{pattern}16', padding=2))
    assert name == 'bgr8'
    assert (array[2:-2, 2:4] == COLORS[2:-2, 2:4]).all()
    assert (array[2:-2, -4:-2] == COLORS[2:-2, -4:-2]).all()


@pytest.mark.parametrize(
    ('encoding', 'order'),
    [('yuv422_yuy2', 'yuyv'), ('yuyv', 'yuyv'), ('uyvy', 'uyvy'), ('yuv422', 'uyvy')],
)
def test_shared_chroma(encoding, order):
    array, name = to_array(message_of(yuv(order), encoding, padding=4))
    assert name == 'bgr8'
    assert np.abs(array.astype(int) - COLORS).max() <= CHROMA_LEVELS


@pytest.mark.parametrize(
    ('change', 'words'),
    [
        ({'encoding': '16UC1'}, "'16UC1' is not taken; expected one of bgr8, rgb8"),
        ({'encoding': 'mono16', 'width': 19}, 'mono16 has rows of 36 bytes; expected 38'),
        ({'encoding': ''}, "'' is not taken"),
        ({'width': 0}, '0x8 px in bgr8; expected sides of 1 to'),
        ({'height': 2**31}, '12x2147483648 px in bgr8; expected sides'),
        ({'width': 13}, 'rows of 36 bytes; expected 39'),
        ({'height': 9}, 'has 288 bytes; expected 324'),
        ({'step': 0}, 'rows of 0 bytes; expected 36'),
        ({'encoding': 'yuyv', 'width': 11}, '11x8 px in yuyv; .* even size'),
        ({'encoding': 'bayer_rggb8', 'height': 7}, '12x7 px in bayer_rggb8; .* even size'),
    ],
)
def test_what_cannot_be_is_refused_by_name(change, words):
    message = message_of(COLORS, 'bgr8')
    for name, value in change.items():
        setattr(message, name, value)
    with pytest.raises(ImageFormatError, match=words):
        to_array(message)


@pytest.mark.parametrize('encoding', CHANNELS)
def test_a_message_holds_what_was_put_in(encoding):
    pixels = COLORS[..., 0] if encoding == 'mono8' else COLORS
    header = Header(frame_id='left_optical_frame')
    message = to_message(pixels[:, 2:9], encoding, header)
    assert message.header == header
    array, name = to_array(message)
    assert name == encoding
    assert (array == pixels[:, 2:9]).all()


def test_a_buffer_is_its_message():
    buffer = ImageBuffer(12, 8, 'bgr8')
    buffer.array[:] = COLORS
    assert (to_array(buffer.message)[0] == COLORS).all()
    assert buffer.fits(12, 8, 'bgr8')
    assert not buffer.fits(12, 8, 'rgb8')


@pytest.mark.parametrize(
    ('encoding', 'form'),
    [
        ('bgr8', 'bgr8; jpeg compressed bgr8'),
        ('rgb8', 'rgb8; jpeg compressed bgr8'),
        ('mono8', 'mono8; jpeg compressed '),
    ],
)
def test_jpeg_is_what_image_transport_reads(encoding, form):
    message = to_jpeg(converted(COLORS, 'bgr8', encoding), encoding, Header(), 95)
    assert message.format == form
    array, name = from_jpeg(message)
    assert name == ('mono8' if encoding == 'mono8' else 'bgr8')
    expected = converted(COLORS, 'bgr8', name)
    assert np.abs(array[:, 1:5].astype(int) - expected[:, 1:5]).max() <= CHROMA_LEVELS


def compressed(image, form, suffix='.png'):
    message = CompressedImage(format=form)
    message.data.frombytes(cv2.imencode(suffix, image)[1].tobytes())
    return message


@pytest.mark.parametrize('pattern', ['rggb', 'bggr', 'gbrg', 'grbg'])
@pytest.mark.parametrize(
    ('kind', 'scale', 'suffix'),
    [('8; jpeg', 1, '.jpg'), ('8; png', 1, '.png'), ('16; png', 256, '.png')],
)
def test_a_compressed_bayer_pattern_gives_the_colors_back(pattern, kind, scale, suffix):
    sensor = mosaic(pattern, np.uint16) * scale
    sensor = sensor.astype(np.uint8) if scale == 1 else sensor
    array, name = from_jpeg(compressed(sensor, f'bayer_{pattern}{kind} compressed ', suffix))
    assert name == 'bgr8'
    # JPEG blurs the mosaic; what is grey in all channels would be off by tens.
    levels = 40 if suffix == '.jpg' else 0
    for columns in (slice(2, 4), slice(-4, -2)):
        difference = array[2:-2, columns].astype(int) - COLORS[2:-2, columns]
        assert np.abs(difference.mean(axis=(0, 1))).max() <= levels


@pytest.mark.parametrize(
    ('form', 'name'),
    [
        ('', 'bgr8'),
        ('jpeg', 'bgr8'),
        ('png', 'bgr8'),
        ('bgr8; png compressed bgr8', 'bgr8'),
        ('rgb8; png compressed bgr8', 'bgr8'),
        ('rgba8; png compressed bgr8', 'bgr8'),
        ('bgr8; png compressed rgb8', 'rgb8'),
        ('8UC3; png compressed ', 'bgr8'),
        ('bgr16; png compressed bgr16', 'bgr8'),
        ('mono8; png compressed ', 'mono8'),
        ('mono16; png compressed ', 'mono8'),
        ('8UC1; png compressed ', 'mono8'),
    ],
)
def test_the_format_says_what_was_compressed(form, name):
    image = COLORS[..., 0] if name == 'mono8' else COLORS
    if '16' in form:
        image = image.astype(np.uint16) * 256 + 77
    array, told = from_jpeg(compressed(image, form))
    assert told == name
    np.testing.assert_array_equal(array, image // 256 if '16' in form else image)


def test_a_compressed_bayer_pattern_needs_whole_blocks():
    with pytest.raises(ImageFormatError, match=r'11x8 px in bayer_rggb8; .* even size'):
        from_jpeg(compressed(COLORS[:, :11, 0], 'bayer_rggb8; png compressed '))


@pytest.mark.parametrize('data', [b'', b'no picture', b'\xff\xd8\xff'])
def test_broken_jpeg_is_refused(data):
    message = CompressedImage(format='jpeg')
    message.data.frombytes(data)
    with pytest.raises(ImageFormatError, match=f'{len(data)} bytes are not an image'):
        from_jpeg(message)


def test_a_coded_picture_that_claims_to_be_huge_is_refused_before_it_is_decoded():
    message = to_jpeg(np.zeros((48, 64, 3), np.uint8), 'bgr8', Header(), 80)
    at = bytes(message.data).index(b'\xff\xc0') + 5
    message.data[at : at + 4] = array('B', (30_000).to_bytes(2, 'big') * 2)
    with pytest.raises(ImageFormatError, match='30000x30000 px; expected up to 50 million px'):
        from_jpeg(message)
