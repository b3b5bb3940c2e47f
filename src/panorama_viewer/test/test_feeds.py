"""H.264 for one page, as a client of its own sees it."""

import sys

import cv2
import numpy as np
from serving import address, picture, state, visit

from fisheye_core.errors import VideoError
from fisheye_core.video import video_decoder
from panorama_viewer.feeds import DELTA, KEYFRAME, JpegFeed
from panorama_viewer.settings import ViewerSettings

PROTOCOLS = ('panorama', 'h264')
SIZE = 640, 240
CLOSE = 6.0
"""Mean difference of a picture that was coded twice, grey levels."""


def jpeg(number):
    """Return a picture of its own, whose grey tells which it is, and its JPEG."""
    image = np.full((*SIZE[::-1], 3), 40 + 10 * number, np.uint8)
    cv2.circle(image, (30 * number, 100), 40, (200, 90, 30), -1)
    return image, cv2.imencode('.jpg', image)[1].tobytes()


def look(session, server):
    return session.ws_connect(address(server, 'live'), protocols=PROTOCOLS)


async def shown(server, stream, number):
    """Show a picture, and return how its message begins and the rest."""
    server.show(jpeg(number)[1])
    data = await picture(stream)
    return data[:1], data[1:]


def test_pictures_come_as_h264_that_begins_with_a_keyframe(serve):
    server, decoder = serve(), video_decoder()

    async def scenario(session):
        async with look(session, server) as stream:
            assert (await state(stream, lambda _: True))['format'] == 'H.264'
            for number in range(5):
                kind, data = await shown(server, stream, number)
                assert kind == (DELTA if number else KEYFRAME)
                image = decoder.decode(data)
                assert abs(image - jpeg(number)[0].astype(float)).mean() < CLOSE
                await stream.send_str('drawn')

    visit(scenario)


def kinds_around(server, change):
    """Return how the messages of four pictures begin; `change` comes after the second."""

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            kinds = []
            for number in range(4):
                kinds.append((await shown(server, stream, number))[0])
                await stream.send_str('drawn')
                if number == 1:
                    await change(stream)
            return kinds

    return visit(scenario)


def test_a_page_that_cannot_go_on_gets_a_keyframe(serve):
    server = serve()

    async def ask(stream):
        await stream.send_str('h264')
        server.tell(mark=1)
        await stream.send_str('heard')
        await state(stream, lambda told: told.get('mark'))

    assert kinds_around(server, ask) == [KEYFRAME, DELTA, KEYFRAME, DELTA]


def test_a_bit_rate_that_is_set_applies_at_once(serve):
    server = serve(video_bitrate_kbps=2000)

    async def lower(_):
        server.apply(ViewerSettings(video_bitrate_kbps=1500))

    expected = [KEYFRAME, DELTA, KEYFRAME, DELTA]
    assert kinds_around(server, lower) == expected, 'the encoder was opened anew'


def test_a_page_can_give_h264_up(serve):
    server = serve()

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            assert (await shown(server, stream, 0))[0] == KEYFRAME
            await stream.send_str('jpeg')
            await stream.send_str('drawn')
            await state(stream, lambda told: told['format'] == 'JPEG')
            server.show(jpeg(1)[1])
            assert await picture(stream) == jpeg(1)[1]

    visit(scenario)


def test_a_jpeg_waits_for_all_that_is_on_its_way():
    feed = JpegFeed(under_way=2)  # H.264 that was sent before it was given up
    for _ in range(2):
        assert not feed.takes(None, 0.0, 0)
        feed.drawn(0.0)
    assert feed.takes(None, 0.0, 0)
    feed.sent(0.0, 1000)
    assert not feed.takes(None, 0.0, 0)


def test_who_asks_for_h264_does_not_change_what_others_get(serve):
    server = serve()

    async def scenario(session):
        async with (
            look(session, server) as video,
            session.ws_connect(address(server, 'live')) as plain,
        ):
            await state(video, lambda _: True)
            assert (await state(plain, lambda _: True))['format'] == 'JPEG'
            assert (await shown(server, video, 3))[0] == KEYFRAME
            assert await picture(plain) == jpeg(3)[1]

    visit(scenario)


def test_a_page_that_draws_nothing_gets_one_picture_and_then_the_newest(serve):
    server, decoder = serve(), video_decoder()

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            decoder.decode((await shown(server, stream, 0))[1])
            for number in range(1, 6):
                server.show(jpeg(number)[1])
            server.tell(mark=1)
            # What was sent before this state would have come before it.
            await state(stream, lambda told: told.get('mark'))
            await stream.send_str('drawn')
            image = decoder.decode((await picture(stream))[1:])
            assert abs(image - jpeg(5)[0].astype(float)).mean() < CLOSE

    visit(scenario)


def test_a_broken_picture_is_left_out(serve):
    server = serve()

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            server.show(b'\xff\xd8 no picture')
            server.tell(mark=1)
            await state(stream, lambda told: told.get('mark'))
            assert (await shown(server, stream, 2))[0] == KEYFRAME

    visit(scenario)


def test_without_an_encoder_the_page_gets_jpeg_and_the_reason(serve, monkeypatch):
    monkeypatch.setitem(sys.modules, 'av', None)  # its import fails
    server = serve()

    async def scenario(session):
        async with look(session, server) as stream:
            told = await state(stream, lambda _: True)
            assert told['format'] == 'JPEG'
            assert 'video needs PyAV' in told['no_video']
            server.show(jpeg(1)[1])
            assert await picture(stream) == jpeg(1)[1]

    visit(scenario)


def test_an_encoder_that_fails_leaves_jpeg_and_the_reason(serve, monkeypatch):
    def fail(*_, **__):
        raise VideoError('no encoder works')

    monkeypatch.setattr('fisheye_core.h264_encoder.H264Encoder.encode', fail)
    server = serve()

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            server.show(jpeg(1)[1])
            assert await picture(stream) == jpeg(1)[1]
            server.tell(mark=1)
            told = await state(stream, lambda told: told.get('mark'))
            assert (told['format'], told['no_video']) == ('JPEG', 'no encoder works')

    visit(scenario)
