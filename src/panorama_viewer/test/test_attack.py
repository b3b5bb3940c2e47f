"""The server under attack: real sockets of other processes, and the operator's rate."""

import asyncio
import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import aiohttp
import attack
import pytest
import serving

DEADLINE_S = 120.0
PICTURES = 24
UNDISTURBED = 0.7
"""Of the rate without the attack, within the deadline."""
ELSEWHERE = '127.0.0.2'
"""Another client: all of 127/8 is this machine."""


def start(*arguments, prefix=()):
    return subprocess.Popen(
        [*prefix, sys.executable, Path(attack.__file__), *map(str, arguments)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


class Served:
    """A server in a process of its own."""

    def __init__(self, prefix=(), **settings):
        self.process = start('serve', json.dumps(settings), prefix=prefix)
        vars(self).update(json.loads(self.process.stdout.readline()))

    def look(self, session, token=None):
        token = self.token if token is None else token
        protocols = ('panorama', f'token.{token}') if token else ()
        return session.ws_connect(f'http://127.0.0.1:{self.port}/live', protocols=protocols)

    def end(self):
        """End it; give the faults that it noted and what it wrote to the log."""
        said, log = self.process.communicate(timeout=DEADLINE_S)
        return json.loads(said), log


@pytest.fixture
def serve():
    """Return a function that starts a server, which must end without a fault and a log."""
    servers = []

    def run(**settings):
        servers.append(Served(**settings))
        return servers[-1]

    yield run
    for server in servers:
        if server.process.poll() is None:
            assert server.end() == ([], '')


@pytest.fixture
def attackers():
    processes = []

    def run(kind, port, source):
        processes.append(start(kind, port, source))
        return processes[-1]

    yield run
    for process in processes:
        process.kill()
        process.communicate()


visit = partial(serving.visit, deadline_s=DEADLINE_S)


async def pictures(stream, count):
    """Draw pictures; give the rate, Hz."""
    loop, begin_s, drawn = asyncio.get_running_loop(), None, -1
    while drawn < count:
        message = await stream.receive()
        if message.type is aiohttp.WSMsgType.BINARY:
            begin_s = begin_s or loop.time()
            drawn += 1
            await stream.send_str('drawn')
        else:
            assert message.type is aiohttp.WSMsgType.TEXT, message
    return count / (loop.time() - begin_s)


async def undisturbed(stream, alone_hz):
    """Draw pictures until they come as without the attack: other work on the machine ends."""
    while (attacked_hz := await pictures(stream, PICTURES)) < UNDISTURBED * alone_hz:
        pass
    return attacked_hz


async def open_page(session, server):
    """Load what a browser loads, then look; give the stream."""
    while True:
        try:
            for name in ('', 'main.js', 'live.js', 'viewer.css'):
                async with session.get(f'http://127.0.0.1:{server.port}/{name}') as reply:
                    assert reply.status == 200
                    await reply.read()
            stream = await server.look(session)
            await pictures(stream, 1)
        except (aiohttp.ClientError, OSError):
            await asyncio.sleep(0.05)  # as a person loads the page again
        else:
            return stream


@pytest.mark.parametrize(
    ('kind', 'is_public'),
    [(kind, False) for kind in attack.ATTACKS]
    # What follows the handshake is heard only from those that may look.
    + [(kind, True) for kind in ('idle', 'drawn', 'ping', 'piece')],
)
def test_an_attack_neither_slows_the_operator_nor_shuts_one_out(serve, attackers, kind, is_public):
    server = serve(public=is_public)

    async def scenario(session):
        async with server.look(session) as stream:
            alone_hz = await pictures(stream, PICTURES)
            attacker = attackers(kind, server.port, ELSEWHERE)
            ready = asyncio.create_task(asyncio.to_thread(attacker.stdout.readline))
            while not ready.done():  # who draws nothing meanwhile is shown out
                await pictures(stream, 1)
            await ready
            await pictures(stream, PICTURES // 2)
            attacked_hz = await undisturbed(stream, alone_hz)
            print(f'{kind}: {alone_hz:.1f} Hz alone, {attacked_hz:.1f} Hz attacked')
        second = await open_page(session, server)
        await undisturbed(second, alone_hz)
        await second.close()

    visit(scenario)


@pytest.mark.parametrize('kind', ['silent', 'idle', 'drawn'])
def test_the_operator_gets_in_beside_attackers_at_the_same_address(serve, attackers, kind):
    server = serve(public=True)
    attacker = attackers(kind, server.port, '127.0.0.1')
    attacker.stdout.readline()

    async def scenario(session):
        stream = await open_page(session, server)
        await pictures(stream, PICTURES)
        await stream.close()

    visit(scenario)


def test_a_server_that_has_no_descriptors_left_says_so_once(serve, attackers):
    server = serve(prefix=('prlimit', '--nofile=64'))
    attacker = attackers('silent', server.port, ELSEWHERE)
    attacker.stdout.readline()

    async def scenario(session):
        stream = await open_page(session, server)
        await pictures(stream, PICTURES)
        await stream.close()

    visit(scenario)
    (fault,), log = server.end()
    assert 'Too many open files' in fault
    assert log == ''
