"""Encoding: one packet for each picture at once, as small as asked, whatever comes."""

import sys
from dataclasses import replace
from itertools import accumulate, repeat

import av
import cv2
import numpy as np
import pytest
from av.video.frame import PictureType
from moving_pictures import moving_pictures, noise_pictures

from fisheye_core.errors import ImageFormatError, VideoError
from fisheye_core.h264_encoder import H264Encoder
from fisheye_core.nal_units import is_keyframe, parameter_sets, units
from fisheye_core.planar_picture import MAX_MACROBLOCKS, to_planes
from fisheye_core.video import video_decoder, video_encoder
from fisheye_core.video_settings import ENCODERS, VideoSettings

CAP_KBPS, PLENTY_KBPS = 400, 4000
EXCESS = 1.05
"""Of the cap in any second: a full buffer beside the rate."""
PARAMETER_SETS = {7, 8}
HZ = 30.0
SAME_DB = 32.0
"""The next picture of the scene has 20."""


@pytest.fixture
def encoder():
    return H264Encoder(bitrate_kbps=CAP_KBPS, keyframe_s=1.0, encoder='libx264')


def stream(encoder, pictures, hz=HZ):
    """Encode pictures at a rate; return what came, each with its time."""
    times_s = [number / hz for number in range(len(pictures))]
    return [
        (now_s, encoder.encode(picture, 'bgr8', now_s))
        for now_s, picture in zip(times_s, pictures, strict=True)
    ]


def most_kbps(packets):
    """Return what came in the fullest second."""
    return max(
        sum(8e-3 * len(other.data) for at_s, other in packets if now_s <= at_s < now_s + 1)
        for now_s, _ in packets
    )


def test_each_picture_is_one_packet_that_is_decoded_at_once(encoder):
    encoder.bitrate_kbps = PLENTY_KBPS
    decoder, pictures = video_decoder(), moving_pictures(40)
    for now_s, picture in zip(accumulate(repeat(1 / HZ)), pictures):  # noqa: B905
        encoded = encoder.encode(picture, 'bgr8', now_s)
        shown = decoder.decode(encoded.data, 'mono8', now_s)
        assert psnr(shown, picture) > SAME_DB


def psnr(luminance, picture):
    grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    return cv2.PSNR(luminance, grey)


def test_keyframes_come_in_time_with_their_parameter_sets_and_no_picture_waits_for_a_later_one(
    encoder,
):
    packets = [encoded for _, encoded in stream(encoder, moving_pictures(75))]
    assert [number for number, p in enumerate(packets) if p.is_keyframe] == [0, 30, 60]
    for packet in packets:
        kinds = {kind for kind, *_ in units(packet.data)}
        assert packet.data.startswith((b'\0\0\1', b'\0\0\0\1'))
        assert (kinds >= PARAMETER_SETS) == packet.is_keyframe == is_keyframe(packet.data)
    context = av.CodecContext.create('h264', 'r')
    kinds = {f.pict_type for p in packets for f in context.decode(av.Packet(p.data))}
    assert kinds == {PictureType.I, PictureType.P}


@pytest.mark.parametrize(
    ('hz', 'keyframe_s', 'every'),
    [(20.0, 1.0, 20), (34.0, 1.0, 34), (2.0, 1.0, 2), (0.2, 10.0, 2)],
)
def test_keyframes_come_in_time_at_any_rate(encoder, hz, keyframe_s, every):
    encoder.keyframe_s = keyframe_s
    # After some more pictures a slow rate is noticed, and begins with a keyframe.
    count = 2 * every + 5
    packets = [encoded for _, encoded in stream(encoder, moving_pictures(count), hz)]
    keyframes = [number for number, p in enumerate(packets) if p.is_keyframe]
    assert keyframes == list(range(0, count, every))


def test_without_keyframes_the_picture_is_renewed_in_parts(encoder):
    encoder.keyframe_s, encoder.bitrate_kbps = 0.0, PLENTY_KBPS
    packets = [encoded for _, encoded in stream(encoder, moving_pictures(75))]
    assert [number for number, p in enumerate(packets) if p.is_keyframe] == [0]
    # A decoder that shows whatever it gets is right after two rounds, though the first is missing.
    context = av.CodecContext.create('h264', 'r')
    context.flags = int(context.flags) | 1 << 3  # AV_CODEC_FLAG_OUTPUT_CORRUPT
    sets, frames = parameter_sets(packets[0].data), []
    for packet in packets[5:]:
        frames += context.decode(av.Packet(sets + packet.data))
        sets = b''
    frames += context.decode(None)
    assert psnr(frames[-1].to_ndarray(format='gray'), moving_pictures(75)[-1]) > SAME_DB


@pytest.mark.parametrize('keyframe_s', [1.0, 0.0])
@pytest.mark.parametrize('hz', [10.0, 30.0, 60.0])
@pytest.mark.parametrize('pictures', [moving_pictures, noise_pictures])
def test_no_second_holds_more_than_the_cap(encoder, keyframe_s, hz, pictures):
    encoder.keyframe_s = keyframe_s
    packets = stream(encoder, pictures(round(2 * hz)), hz)
    # The rate is noticed after some pictures, which are as large as at the usual one.
    settled = [(now_s, packet) for now_s, packet in packets if now_s > 0.5 or hz == HZ]
    assert most_kbps(settled) < EXCESS * CAP_KBPS


@pytest.mark.parametrize('hz', [0.1, 1.2])
def test_pictures_of_slow_streams_are_large_but_no_second_holds_more_than_the_cap(encoder, hz):
    settled = stream(encoder, noise_pictures(20), hz)[11:]
    assert 0.5 * CAP_KBPS < most_kbps(settled) < EXCESS * CAP_KBPS


def test_keyframes_that_are_asked_for_again_and_again_stay_within_the_cap(encoder):
    packets = []
    for number, picture in enumerate(noise_pictures(60)):
        if number % 5 == 0:
            encoder.request_keyframe()
        packets.append((number / HZ, encoder.encode(picture, 'bgr8', number / HZ)))
    assert [p.is_keyframe for _, p in packets] == [n % 5 == 0 for n in range(60)]
    assert most_kbps(packets) < EXCESS * CAP_KBPS


def test_another_bit_rate_holds_from_the_next_picture_on(encoder):
    pictures = noise_pictures(60)
    before = stream(encoder, pictures[:30])
    encoder.bitrate_kbps = CAP_KBPS // 2
    after = [(1 + s, p) for s, p in stream(encoder, pictures[30:])]
    assert most_kbps(before) > 0.8 * CAP_KBPS
    assert most_kbps(after) < EXCESS * CAP_KBPS / 2


@pytest.mark.parametrize('encoding', ['bgr8', 'rgb8', 'mono8'])
def test_sizes_change_at_any_time(encoder, encoding):
    decoder = video_decoder()
    rng = np.random.default_rng(3)
    for number, (width, height) in enumerate([(64, 48), (1183, 501), (1, 1), (17, 2), (17, 2)]):
        shape = (height, width) if encoding == 'mono8' else (height, width, 3)
        image = np.full(shape, 90, np.uint8)
        image[..., 0] = rng.integers(50, 200)
        encoded = encoder.encode(image, encoding, number / HZ)
        shown = decoder.decode(encoded.data, encoding, number / HZ)
        even = height + height % 2, width + width % 2
        assert shown.shape == even + shape[2:]
        assert np.abs(shown[:height, :width].astype(int) - image).mean() < 12


@pytest.mark.parametrize('size', [(9000, 40), (4400, 2400)])
def test_what_no_decoder_takes_is_halved(encoder, size):
    image = np.zeros((size[1], size[0]), np.uint8)
    shown = video_decoder().decode(encoder.encode(image, 'mono8').data, 'mono8')
    assert shown.shape == (size[1] // 2, size[0] // 2)
    assert -(-shown.shape[0] // 16) * -(-shown.shape[1] // 16) <= MAX_MACROBLOCKS


def test_colour_survives():
    image = np.zeros((32, 32, 3), np.uint8)
    image[:] = 40, 160, 220
    encoded = video_encoder(VideoSettings()).encode(image)
    assert np.abs(video_decoder().decode(encoded.data).astype(int) - image).max() <= 4


def test_grey_has_the_range_that_it_has_in_colour():
    grey = np.arange(256, dtype=np.uint8).reshape(16, 16)
    planes = to_planes(np.repeat(grey[..., None], 3, axis=2), 'bgr8')
    assert np.abs(to_planes(grey, 'mono8').astype(int) - planes).max() <= 1


def test_an_empty_picture_is_refused_in_a_sentence(encoder):
    with pytest.raises(ImageFormatError, match='0x3 px is empty'):
        encoder.encode(np.zeros((3, 0, 3), np.uint8))


@pytest.mark.parametrize('name', ENCODERS)
def test_an_encoder_that_cannot_work_here_is_told_and_replaced(name):
    encoder = video_encoder(replace(VideoSettings(), video_encoder=name))
    assert encoder.encode(moving_pictures(1)[0]).is_keyframe
    is_as_asked = encoder.name == name or name == 'auto'
    assert is_as_asked == (encoder.note == '')
    if not is_as_asked:
        assert encoder.note.startswith(f'{name} cannot be used: ')
        assert encoder.note.endswith('; libx264 encodes in its place')


@pytest.mark.parametrize('make', [lambda: video_encoder(VideoSettings()), video_decoder])
def test_without_pyav_a_sentence_says_what_to_install(monkeypatch, make):
    monkeypatch.setitem(sys.modules, 'av', None)
    with pytest.raises(VideoError, match=r'needs PyAV.*apt install python3-av'):
        make()
