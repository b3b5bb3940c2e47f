"""Decoding: pictures at once, none that is drawn upon a gap, whatever bytes come."""

import cv2
import numpy as np
import pytest
from moving_pictures import moving_pictures

from fisheye_core.h264_encoder import H264Encoder
from fisheye_core.nal_units import units
from fisheye_core.video import video_decoder

COUNT, GOP = 40, 10
HZ = 30.0
FUZZED = 1000


@pytest.fixture(scope='module')
def packets():
    return encoded(moving_pictures(COUNT))


def encoded(pictures):
    """Return a packet for each picture, a keyframe each `GOP`."""
    encoder = H264Encoder(bitrate_kbps=2000, keyframe_s=GOP / HZ, encoder='libx264')
    return [
        encoder.encode(picture, 'bgr8', number / HZ).data
        for number, picture in enumerate(pictures)
    ]


def shown(packets, harm, decoder=None, hz=HZ):
    """Return the numbers of the packets after which a picture came, and the decoder."""
    decoder, numbers = decoder or video_decoder(), []
    for number, packet in enumerate(packets):
        data = harm(number, packet)
        if data is not None and decoder.decode(data, 'bgr8', number / hz) is not None:
            numbers.append(number)
    return numbers, decoder


def test_each_picture_is_there_with_its_own_packet(packets):
    numbers, decoder = shown(packets, lambda n, data: data)
    assert numbers == list(range(COUNT))
    assert decoder.damaged == 0
    assert not decoder.wants_keyframe


def test_large_pictures_that_are_cut_into_slices_are_whole(monkeypatch):
    monkeypatch.setattr('os.cpu_count', lambda: 2)
    still = np.full((1000, 1100), 90, np.uint8)
    large = encoded([cv2.cvtColor(still + np.uint8(n), cv2.COLOR_GRAY2BGR) for n in range(4)])
    assert all([kind for kind, *_ in units(data)].count(1) == 2 for data in large[1:])
    assert shown(large, lambda n, data: data)[0] == list(range(4))
    assert shown(large, lambda n, data: None if n == 1 else data)[0] == [0]


@pytest.mark.parametrize(
    'harm',
    [
        lambda n, data: None if n == 13 else data,
        lambda n, data: None if n in (11, 12, 13) else data,
        lambda n, data: data[: len(data) // 2] if n == 13 else data,
        lambda n, data: b'' if n == 13 else data,
        lambda n, data: b'no video' if n == 13 else data,
    ],
    ids=['one lost', 'three lost', 'cut', 'empty', 'not video'],
)
def test_after_damage_nothing_comes_before_the_next_keyframe(packets, harm):
    numbers, decoder = shown(packets, harm)
    assert set(numbers) >= set(range(11)) | set(range(20, COUNT))
    assert set(range(14, 20)) & set(numbers) == set()
    assert decoder.damaged >= 6


def test_it_says_that_it_wants_a_keyframe(packets):
    decoder = video_decoder()
    assert decoder.wants_keyframe
    decoder.decode(packets[0], 'bgr8', 0.0)
    assert not decoder.wants_keyframe
    decoder.decode(packets[2], 'bgr8', 0.1)
    assert decoder.wants_keyframe


def test_nothing_comes_before_the_first_keyframe(packets):
    numbers, decoder = shown(packets, lambda n, data: data if n > 3 else None)
    assert numbers == list(range(10, COUNT))
    assert decoder.damaged == 0


def test_after_a_pause_a_picture_waits_for_a_keyframe_though_its_number_fits(packets):
    """Numbers have four bits: sixteen pictures that are missing change nothing in them."""
    decoder = video_decoder()
    decoder.decode(packets[0], 'bgr8', 0.0)
    assert decoder.decode(packets[1], 'bgr8', 0.6) is None
    assert decoder.wants_keyframe


def test_slow_cameras_have_no_pauses(packets):
    numbers, _ = shown(packets, lambda n, data: data, hz=1.5)
    assert len(numbers) > COUNT - GOP


def test_grey_and_colour(packets):
    decoder = video_decoder()
    colour = decoder.decode(packets[0], 'bgr8', 0.0)
    assert decoder.decode(packets[1], 'mono8', 0.03).shape == colour.shape[:2]
    assert decoder.decode(packets[2], 'rgb8', 0.06).shape == colour.shape


def test_whatever_comes_it_survives_says_so_and_recovers(packets):
    rng, decoder, losses = np.random.default_rng(11), video_decoder(), 0
    for number in range(FUZZED):
        now_s = number * (COUNT + 1) / HZ
        spoilt = fuzzed(rng, packets[rng.integers(COUNT)])
        decoder.decode(spoilt, ('bgr8', 'mono8')[number % 2], now_s)
        losses += decoder.wants_keyframe
        # With a keyframe it is well again.
        assert decoder.decode(packets[0], 'bgr8', now_s + 1 / HZ).shape[2] == 3
        assert not decoder.wants_keyframe
    assert losses > FUZZED / 2


def fuzzed(rng, data):
    """Return bytes that were changed, cut, doubled, mixed up or made up."""
    data = bytearray(data)
    kind = rng.integers(5)
    if kind == 0:
        for at in rng.integers(len(data), size=rng.integers(1, 200)):
            data[at] = rng.integers(256)
    elif kind == 1:
        del data[rng.integers(len(data)) :]
    elif kind == 2:
        at = sorted(rng.integers(len(data), size=2))
        data[at[0] : at[0]] = data[at[0] : at[1]]
    elif kind == 3:
        head = bytes([0, 0, 0, 1, rng.integers(256)])
        data = head + rng.bytes(rng.integers(3000)) + bytes(data)
    else:
        data = rng.bytes(rng.integers(3000))
    return bytes(data)
