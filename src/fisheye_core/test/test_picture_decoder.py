"""Decoding: at once, and nothing that is drawn upon a gap."""

from fractions import Fraction

import av
import numpy as np
import pytest

from fisheye_core.picture_decoder import PictureDecoder

GOP = 10
TICK = Fraction(1, 30)


@pytest.fixture(scope='module')
def stream_file(tmp_path_factory):
    """Write 40 pictures of moving noise, a keyframe each `GOP`; give the path."""
    path = tmp_path_factory.mktemp('video') / 'noise.ts'
    scene = np.random.default_rng(5).integers(0, 255, (96, 400, 3), np.uint8)
    with av.open(str(path), 'w', format='mpegts') as output:
        video = output.add_stream('libx264', rate=30)
        video.width, video.height, video.pix_fmt = 128, 96, 'yuv420p'
        video.options = {
            'preset': 'ultrafast',
            'tune': 'zerolatency',
            'x264-params': f'keyint={GOP}:min-keyint={GOP}:scenecut=0',
        }
        for n in range(40):
            frame = av.VideoFrame.from_ndarray(scene[:, 4 * n : 4 * n + 128], format='bgr24')
            output.mux(video.encode(frame))
        output.mux(video.encode())
    return path


def decoded(path, harm=lambda n, data: data):
    """Return the numbers of the packets after which a picture came, and the decoder."""
    numbers = []
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        decoder, is_lost = PictureDecoder(stream.codec_context), False
        for n, packet in enumerate(container.demux(stream)):
            data = harm(n, bytes(packet))
            if data:
                spoilt = av.Packet(data)
                spoilt.stream, spoilt.pts, spoilt.dts = packet.stream, packet.pts, packet.dts
                spoilt.time_base = packet.time_base
                lost, is_lost = is_lost, False
                numbers += [n for _ in decoder.decode(spoilt, follows_loss=lost)]
            else:
                is_lost = True
    return numbers, decoder


def test_each_picture_is_there_with_its_own_packet(stream_file):
    numbers, decoder = decoded(stream_file)
    assert numbers == list(range(40))
    assert decoder.damaged == 0


@pytest.mark.parametrize(
    'harm',
    [
        lambda n, data: b'' if n == 13 else data,
        lambda n, data: data[: len(data) // 2] if n == 13 else data,
        lambda n, data: data[:200] + bytes(60) + data[260:] if n == 13 else data,
    ],
    ids=['lost', 'cut', 'overwritten'],
)
def test_after_damage_nothing_comes_before_the_next_keyframe(stream_file, harm):
    numbers, decoder = decoded(stream_file, harm)
    assert set(range(14, 20)) & set(numbers) == set()
    assert numbers[:13] == list(range(13))
    assert numbers[-20:] == list(range(20, 40))
    assert decoder.damaged >= 6


def test_nothing_comes_before_the_first_keyframe(stream_file):
    numbers, decoder = decoded(stream_file, lambda n, data: data if n > 3 else b'')
    assert numbers == list(range(10, 40))
    assert decoder.damaged == 0
