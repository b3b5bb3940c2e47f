"""What browsers that look are sent, and when."""

import asyncio

import aiohttp
import pytest
from serving import address, picture, state, visit

from fisheye_testing.waiting import wait_for


def test_a_slow_browser_gets_fewer_pictures_and_no_old_one(serve):
    server = serve()

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as stream:
            await state(stream, lambda _: True)
            server.show(b'first')
            assert await picture(stream) == b'first'
            server.show(b'overtaken')
            server.show(b'newest')
            server.tell(mark=1)
            # What was sent before this state would have come before it.
            await state(stream, lambda told: told.get('mark') == 1)
            await stream.send_str('drawn')
            assert await picture(stream) == b'newest'

    visit(scenario)


def test_a_fast_browser_does_not_wait_for_a_slow_one(serve):
    server = serve()

    async def scenario(session):
        async with (
            session.ws_connect(address(server, 'live')) as slow,
            session.ws_connect(address(server, 'live')) as fast,
        ):
            await state(slow, lambda _: True)
            await state(fast, lambda _: True)
            for number in range(5):
                server.show(b'%d' % number)
                assert await picture(fast) == b'%d' % number
                await fast.send_str('drawn')
            assert await picture(slow) == b'0'

    visit(scenario)


def test_a_stale_picture_is_shown_to_nobody_new(serve):
    server = serve(stale_after_s=0.1)

    async def shown(jpeg, stream):
        # Until one comes: it may be stale before its turn.
        coming = asyncio.create_task(picture(stream))
        while not coming.done():
            server.show(jpeg)
            await asyncio.wait([coming], timeout=0.05)
        return await coming

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as first:
            await state(first, lambda _: True)
            assert await shown(b'old', first) == b'old'
            status = 200
            while status != 503:
                async with session.post(address(server, 'snapshot')) as reply:
                    status = reply.status
                await asyncio.sleep(0.05)
            async with session.ws_connect(address(server, 'live')) as second:
                await state(second, lambda _: True)
                assert await shown(b'new', second) == b'new'

    visit(scenario)


def test_the_first_browser_and_the_last_are_reported(serve):
    reports = []
    server = serve(watched=lambda: reports.append(server.watchers))

    async def scenario(session):
        async with (
            session.ws_connect(address(server, 'live')) as first,
            session.ws_connect(address(server, 'live')) as second,
        ):
            await state(first, lambda _: True)
            await state(second, lambda _: True)

    visit(scenario)
    wait_for(lambda: len(reports) == 2)
    assert reports == [1, 0]


def test_the_number_of_browsers_is_bounded(serve):
    server = serve(max_clients=1)

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as first:
            await state(first, lambda _: True)
            async with session.ws_connect(address(server, 'live')) as second:
                message = await second.receive()
                assert message.type is aiohttp.WSMsgType.CLOSE
                assert 'the limit' in message.extra

    visit(scenario)


@pytest.mark.parametrize('words', ['what', 'x' * 100_000])
def test_who_says_something_else_is_shown_out(serve, words):
    server = serve()

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as stream:
            await stream.send_str(words)
            async for _ in stream:
                pass
            assert stream.closed

    visit(scenario)


def test_what_levels_a_picture_comes_before_it_and_once(serve):
    server = serve()
    nod = (0.1, 0.0, 0.0, 0.995)

    async def look(session):
        came = []
        async with session.ws_connect(address(server, 'live')) as stream:
            shown = [(b'plain', None), (b'turned', nod), (b'again', nod), (b'level', None)]
            for jpeg, orientation in shown:
                server.show(jpeg, orientation)
                async for message in stream:
                    if message.type is aiohttp.WSMsgType.BINARY:
                        came.append(message.data)
                        break
                    if 'orientation' in message.json():
                        came.append(message.json()['orientation'])
                await stream.send_str('drawn')
        return came

    came = visit(look)
    assert came == [b'plain', list(nod), b'turned', b'again', None, b'level']
