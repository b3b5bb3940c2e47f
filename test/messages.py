"""Hypothesis strategies: messages that nobody sane would send."""

from array import array

import cv2
import numpy as np
from builtin_interfaces.msg import Time
from fisheye_msgs.msg import Projection
from hypothesis import strategies as st
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, RegionOfInterest
from std_msgs.msg import Header

from fisheye_core.encodings import CHANNELS
from fisheye_geometry.surface import SURFACES

_SIZES = st.one_of(
    st.sampled_from([0, 1, 2, 3, 7, 64, 480, 640, 16384, 16385, 2**31, 2**32 - 1]),
    st.integers(0, 2**32 - 1),
)
_ENCODINGS = [*CHANNELS, 'bgra8', 'rgba8', 'yuv422', 'yuv422_yuy2', 'bayer_rggb8', 'bayer_gbrg8']
_KNOWN_MODELS = ['equidistant', 'fisheye', 'plumb_bob', 'rational_polynomial']
texts = st.text(st.characters(exclude_categories=['Cs'], exclude_characters='\0'), max_size=40)
numbers = st.one_of(
    st.sampled_from([0.0, -1.0, 1e-300, 1e300, float('nan'), float('inf'), 320.0]),
    st.floats(),
)


@st.composite
def headers(draw) -> Header:
    """Any stamp that the wire can carry, and any frame."""
    stamp = Time(sec=draw(st.integers(-(2**31), 2**31 - 1)))
    stamp.nanosec = draw(st.integers(0, 2**32 - 1))
    return Header(stamp=stamp, frame_id=draw(texts))


@st.composite
def images(draw) -> Image:
    """Sizes, rows, encodings and data that need not fit together."""
    message = Image(header=draw(headers()), width=draw(_SIZES), height=draw(_SIZES))
    message.encoding = draw(
        st.one_of(st.sampled_from([*_ENCODINGS, 'mono16', '32FC1', '']), texts)
    )
    exact = st.just(min(message.width * CHANNELS.get(message.encoding, 1), 2**32 - 1))
    message.step = draw(st.one_of(exact, _SIZES))
    message.is_bigendian = draw(st.integers(0, 255))
    count = min(message.step * message.height, 100_000)
    message.data = array('B', bytes(draw(st.sampled_from([0, 1, count, count + 1]))))
    return message


def _jpeg(width, height):
    """Return a JPEG whose head claims another size."""
    coded = cv2.imencode('.jpg', np.zeros((48, 64, 3), np.uint8))[1].tobytes()
    at = coded.index(b'\xff\xc0') + 5
    return coded[:at] + height.to_bytes(2, 'big') + width.to_bytes(2, 'big') + coded[at + 4 :]


@st.composite
def compressed_images(draw) -> CompressedImage:
    """Pictures cut short, of absurd size, with flipped bytes, and noise."""
    message = CompressedImage(
        header=draw(headers()), format=draw(st.one_of(st.just('jpeg'), texts))
    )
    whole = _jpeg(draw(st.sampled_from([0, 1, 64, 65535])), draw(st.sampled_from([0, 48, 65535])))
    cut = whole[: draw(st.integers(0, len(whole)))]
    message.data = array(
        'B', draw(st.one_of(st.binary(max_size=200), st.just(cut), st.just(whole)))
    )
    return message


@st.composite
def camera_infos(draw) -> CameraInfo:
    """Cameras of which at least one number is nonsense, and perhaps several."""
    good = [220.0, 0.0, 319.5, 0.0, 220.0, 239.5, 0.0, 0.0, 1.0]
    message = CameraInfo(header=draw(headers()), width=640, height=480)
    message.distortion_model, message.d, message.k = 'equidistant', [0.0] * 4, good
    for part in draw(st.lists(st.sampled_from(['size', 'model', 'd', 'k', 'crop']), min_size=1)):
        if part == 'size':
            message.width, message.height = draw(_SIZES), draw(_SIZES)
        elif part == 'model':
            message.distortion_model = draw(st.one_of(st.sampled_from(_KNOWN_MODELS), texts))
        elif part == 'd':
            message.d = draw(st.lists(numbers, max_size=14))
        elif part == 'k':
            message.k = draw(st.lists(numbers, min_size=9, max_size=9))
        else:
            message.binning_x = draw(_SIZES)
            message.roi = RegionOfInterest(width=draw(_SIZES), height=draw(_SIZES))
    return message


@st.composite
def projections(draw) -> Projection:
    """Surfaces that cannot be."""
    message = Projection(header=draw(headers()), width=draw(_SIZES), height=draw(_SIZES))
    message.surface = draw(st.one_of(st.sampled_from(SURFACES), texts))
    for name in ('focal_px', 'center_x_px', 'center_y_px'):
        setattr(message, name, draw(numbers))
    return message
