"""A viewer's server and its attackers, as processes of their own.

python attack.py serve {"public": true}       prints address and token; ends with its input
python attack.py silent PORT SOURCE           attacks from an address until it is killed
"""

import asyncio
import json
import os
import sys
import threading
from contextlib import suppress

from panorama_viewer.server import ViewerServer
from panorama_viewer.settings import ViewerSettings

RATE_HZ = 30.0
PICTURE = os.urandom(100_000)
"""About what a panorama is as JPEG."""
REQUEST = b'GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n'
HANDSHAKE = (
    b'GET /live HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n'
    b'Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n'
)
DRAWN = b'\x81\x85\0\0\0\0drawn'
PING = b'\x89\x80\0\0\0\0'
PIECE = b'\x01\x80\0\0\0\0'
"""Of a message that never ends."""


def serve(settings):
    """Show pictures until the input ends, and then tell what went wrong."""
    faults = []
    server = ViewerServer(
        ViewerSettings(host='0.0.0.0', port=0, **settings),
        calibrate=None,
        watched=lambda: None,
        report=lambda _, trace: faults.append(trace),
    )
    server.start()
    server.tell(rate_hz=RATE_HZ)
    url, _, token = server.url.partition('/#token=')
    print(json.dumps({'port': int(url.rpartition(':')[2]), 'token': token}), flush=True)
    is_over = threading.Event()

    def show():
        while not is_over.wait(1 / RATE_HZ):
            server.show(PICTURE)

    showing = threading.Thread(target=show)
    showing.start()
    sys.stdin.read()
    is_over.set()
    showing.join()
    server.stop()
    print(json.dumps(faults))


async def silent(reader, writer):
    """Connect and say nothing."""
    await reader.read()


async def idle(reader, writer):
    """Ask for pictures and draw none."""
    writer.write(HANDSHAKE)
    while await reader.read(65536):
        pass


async def slow(reader, writer):
    """Send a header that never ends."""
    writer.write(REQUEST)
    while not reader.at_eof():
        writer.write(b'X-Slow: x\r\n')
        await writer.drain()
        await asyncio.sleep(0.1)


async def nonsense(reader, writer):
    """Send what is no request."""
    writer.write(b'\0 nonsense\r\n\r\n')
    await reader.read()


async def forget(reader, writer):
    """Ask for pages and leave before they come."""
    writer.write(REQUEST + b'\r\n')
    await writer.drain()


def flood(word):
    """Send a word for ever over a WebSocket."""

    async def send(reader, writer):
        writer.write(HANDSHAKE)
        taking = asyncio.create_task(reader.read())
        try:
            while not taking.done():
                writer.write(word * 1000)
                await writer.drain()
        finally:
            taking.cancel()

    return send


ATTACKS = {
    'silent': (silent, 300),
    'idle': (idle, 40),
    'slow': (slow, 100),
    'nonsense': (nonsense, 20),
    'forget': (forget, 20),
    'drawn': (flood(DRAWN), 4),
    'ping': (flood(PING), 4),
    'piece': (flood(PIECE), 4),
}
"""What each client does over and over, and how many there are."""


async def attack(kind, port, source):
    """Attack until the process is killed."""
    client, count = ATTACKS[kind]
    met = 0

    async def again():
        nonlocal met
        while True:
            with suppress(OSError):
                reader, writer = await asyncio.open_connection(
                    '127.0.0.1', port, local_addr=(source, 0)
                )
                met += 1
                if met == count:
                    print('all are there', flush=True)
                try:
                    await client(reader, writer)
                finally:
                    writer.close()
            await asyncio.sleep(0.01)

    await asyncio.gather(*(again() for _ in range(count)))


if __name__ == '__main__':
    if sys.argv[1] == 'serve':
        serve(json.loads(sys.argv[2]))
    else:
        asyncio.run(attack(sys.argv[1], int(sys.argv[2]), sys.argv[3]))
