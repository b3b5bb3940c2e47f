"""Who may look: the token, the places, and how long somebody who does nothing may stay."""

import re
import socket
from concurrent.futures import Future
from contextlib import suppress

import aiohttp
import pytest
from serving import DEADLINE_S, address, here, picture, request, state, token, visit

from panorama_viewer import browser, connection, gate, quiet_sockets

REFUSED, LATER = 1008, 1013


def look(session, server, token=None):
    protocols = ('panorama', f'token.{token}') if token else ()
    return session.ws_connect(here(server, 'live'), protocols=protocols)


async def farewell(stream):
    """Return the code and the reason with which the server ends a connection."""
    while (message := await stream.receive()).type is not aiohttp.WSMsgType.CLOSE:
        assert not stream.closed, 'it ended without a word'
    return message.data, message.extra


@pytest.mark.parametrize('given', [None, 'guess', 'x' * 500])
def test_who_has_no_token_sees_nothing_from_elsewhere(serve, given):
    server = serve(host='0.0.0.0')
    server.show(b'secret')

    async def scenario(session):
        async with look(session, server, given) as stream:
            message = await stream.receive()
            assert (message.type, message.data) == (aiohttp.WSMsgType.CLOSE, REFUSED)
            assert 'needs the token' in message.extra

    visit(scenario)
    assert server.watchers == 0


@pytest.mark.parametrize('is_public', [False, True])
def test_who_has_the_token_sees_the_picture(serve, is_public):
    server = serve(host='0.0.0.0', public=is_public)

    async def scenario(session):
        async with look(session, server, token(server)) as stream:
            assert (await state(stream, lambda _: True))['needs_token']
            server.show(b'picture')
            assert await picture(stream) == b'picture'

    visit(scenario)


def test_everybody_sees_what_is_public_but_the_buttons_need_the_token(serve):
    server = serve(host='0.0.0.0', public=True)

    async def scenario(session):
        async with look(session, server) as stream:
            await state(stream, lambda _: True)
            server.show(b'picture')
            assert await picture(stream) == b'picture'

    visit(scenario)
    assert request('POST', here(server, 'snapshot'))[0] == 403


def test_another_protocol_is_refused_without_a_word_in_the_log(serve, caplog):
    server = serve()

    async def scenario(session):
        with pytest.raises(aiohttp.WSServerHandshakeError, match='400'):
            await session.ws_connect(address(server, 'live'), protocols=('other',))

    visit(scenario)
    assert not [record for record in caplog.records if record.name != 'asyncio']


def test_who_has_the_token_gets_the_place_of_one_who_has_not(serve):
    server = serve(host='0.0.0.0', public=True, max_clients=2)

    async def scenario(session):
        strangers = [await look(session, server) for _ in range(2)]
        for stranger in strangers:
            await state(stranger, lambda _: True)
        refused = await look(session, server)
        assert await farewell(refused) == (LATER, '2 browsers look already, which is the limit')
        operators = []
        for stranger in strangers:
            operators.append(await look(session, server, token(server)))
            await state(operators[-1], lambda _: True)
            assert await farewell(stranger) == (LATER, 'somebody with the token needed the place')
        third = await look(session, server, token(server))
        assert (await farewell(third))[0] == LATER
        assert not any(operator.closed for operator in operators)

    visit(scenario)


@pytest.mark.parametrize('said', [b'', b'GET / HTTP/1.1\r\nHost: localhost\r\n'])
def test_a_connection_without_a_request_ends(serve, monkeypatch, said):
    for module in (connection, quiet_sockets):
        monkeypatch.setattr(module, 'ANSWERED_WITHIN_S', 0.2)
    port = int(re.search(r':(\d+)/', serve().url)[1])
    with (
        socket.create_connection(('127.0.0.1', port), timeout=DEADLINE_S) as client,
        suppress(ConnectionError),  # it may have ended before all is said
    ):
        client.sendall(said)
        assert client.recv(1) == b''


def test_who_says_nothing_takes_no_place_of_those_who_ask(serve, monkeypatch):
    monkeypatch.setattr(quiet_sockets, 'MAX_QUIET', 2)
    monkeypatch.setattr(gate, 'MAX_STRANGERS', 1)
    server = serve()
    place = '127.0.0.1', int(re.search(r':(\d+)/', server.url)[1])
    asking, *silent = [socket.create_connection(place, timeout=DEADLINE_S) for _ in range(2)]
    asking.sendall(b'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n')
    assert asking.recv(15) == b'HTTP/1.1 200 OK'
    silent += [socket.create_connection(place, timeout=DEADLINE_S) for _ in range(2)]
    assert silent[0].recv(1) == b'', 'the oldest goes'
    assert asking.recv(1)
    for client in silent[1:]:
        client.setblocking(False)
        with pytest.raises(BlockingIOError):
            client.recv(1)
    for client in (asking, *silent):
        client.close()


def test_a_page_that_draws_nothing_leaves_its_place(serve, monkeypatch):
    monkeypatch.setattr(browser, 'SILENT_S', 0.2)
    server = serve()

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as stream:
            await state(stream, lambda _: True)
            server.show(b'picture')
            assert await picture(stream) == b'picture'
            code, reason = await farewell(stream)
            assert code == LATER
            assert 'drawn nothing' in reason

    visit(scenario)


def test_who_draws_more_often_than_pictures_come_gets_no_more_of_them(serve):
    server = serve()

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as stream:
            await state(stream, lambda _: True)
            for _ in range(20):
                await stream.send_str('drawn')
            # Is answered with the state: what was sent before it has been heard then.
            await stream.send_str('jpeg')
            await state(stream, lambda _: True)
            server.show(b'first')
            assert await picture(stream) == b'first'
            server.show(b'overtaken')
            server.show(b'second')
            server.tell(mark=1)
            await state(stream, lambda told: told.get('mark') == 1)
            await stream.send_str('drawn')
            assert await picture(stream) == b'second'

    visit(scenario)


def test_a_bug_takes_only_its_part_down_and_is_told_once(serve):
    def fail():
        raise KeyError('a bug')

    server = serve(fail)

    async def scenario(session):
        async with session.ws_connect(address(server, 'live')) as stream:
            await state(stream, lambda _: True)
            for _ in range(3):
                async with session.post(address(server, 'calibrate')) as reply:
                    assert reply.status == 500
            server.show(b'on')
            assert await picture(stream) == b'on'
            server.tell(wrong=object())
            while not stream.closed:
                await stream.receive()
        server.tell(wrong=None)
        async with session.ws_connect(address(server, 'live')) as stream:
            await state(stream, lambda _: True)

    visit(scenario)
    calibration, feeding = server.faults
    assert 'KeyError' in calibration
    assert 'test_access.py' in calibration
    assert 'JSON' in feeding
    server.faults.clear()


def test_a_calibration_that_is_a_bug_in_its_answer_is_a_fault_too(serve):
    future = Future()
    future.set_exception(ZeroDivisionError('a bug'))
    server = serve(lambda: future)
    assert request('POST', address(server, 'calibrate'))[0] == 500
    assert 'ZeroDivisionError' in server.faults.pop()
