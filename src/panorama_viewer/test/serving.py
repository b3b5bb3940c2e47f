"""Visits to a viewer's server, as a browser makes them."""

import asyncio
import json
from concurrent.futures import Future

import aiohttp

DEADLINE_S = 10.0


def answered(sentence):
    future = Future()
    future.set_result(sentence)
    return future


def visit(scenario, deadline_s=DEADLINE_S):
    """Run a coroutine that takes a client session."""

    async def run():
        async with aiohttp.ClientSession() as session:
            return await asyncio.wait_for(scenario(session), deadline_s)

    return asyncio.run(run())


def address(server, path=''):
    return server.address + path


def here(server, path=''):
    """Return an address of a server that serves other machines, as this machine reaches it."""
    return f'http://127.0.0.1:{server.address.rpartition(":")[2]}{path}'


def token(server):
    return server.url.partition('#token=')[2]


def request(method, url, **arguments):
    async def scenario(session):
        async with session.request(method, url, **arguments) as reply:
            return reply.status, await reply.read(), reply.headers

    return visit(scenario)


async def picture(stream):
    """Skip the states before the next picture."""
    while True:
        message = await stream.receive()
        if message.type is aiohttp.WSMsgType.BINARY:
            return message.data
        assert message.type is aiohttp.WSMsgType.TEXT, message


async def state(stream, condition):
    while not condition(told := json.loads((await stream.receive()).data)):
        pass
    return told
