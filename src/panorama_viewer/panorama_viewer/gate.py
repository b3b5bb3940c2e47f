"""Who may be connected: bounds that hold before a request has been read.

A socket that has said nothing is only held. One that has begins as a stranger: it must have been
answered within a few seconds, and it goes when room is needed, first of all one from the address
that holds the most. Who has shown the token, or has a place to look from, is known: that
connection stays.
"""

import asyncio
import socket
import ssl
from collections.abc import Callable
from contextlib import suppress
from errno import EADDRNOTAVAIL, EAFNOSUPPORT
from itertools import islice

from aiohttp import web

from panorama_viewer.address import source_of
from panorama_viewer.allowance import Allowances
from panorama_viewer.connection import ANSWERED_WITHIN_S, Connection
from panorama_viewer.faults import Faults
from panorama_viewer.quiet_sockets import QuietSockets, oldest_of_most

MAX_STRANGERS, MAX_ENTERING = 128, 128
"""The latter are in the handshake of https, before they count as strangers."""
_BACKLOG = 128
_AT_ONCE = 16
"""Connections taken before the pictures have their turn again."""
_PAUSE_S = 0.2
"""When the process has no more descriptors, and no stranger holds one."""
_CONNECTS, _CONNECTS_PER_S = 300, 200.0
"""Of one address; the page takes about fifteen."""


class Gate:
    """Listens, and hands connections on to the web server."""

    def __init__(self, faults: Faults, tls: ssl.SSLContext | None = None):
        self._faults, self._tls = faults, tls
        self._loop = asyncio.get_running_loop()
        self._listeners: list[socket.socket] = []
        self._entering: dict[asyncio.Task, None] = {}
        self._connections: dict[asyncio.BaseTransport, Connection] = {}
        self._strangers: dict[Connection, str] = {}
        self._allowances = Allowances(_CONNECTS, _CONNECTS_PER_S)
        self._quiet = QuietSockets(self._admit)

    async def open(self, host: str, port: int, serve: Callable[[], asyncio.Protocol]) -> int:
        """Listen on every address of a host, and return the port.

        Parameters
        ----------
        host, port
            Where; port 0 is a free one.
        serve
            Makes what serves one connection.

        Raises
        ------
        OSError, ValueError
            If there is no such address, or it is in use.
        """
        self._serve = serve
        places = await self._loop.getaddrinfo(host, port, type=socket.SOCK_STREAM)
        failed = None
        for family, _, _, _, address in dict.fromkeys(places):
            try:
                listener = socket.create_server(
                    address[:2],
                    family=family,
                    backlog=_BACKLOG,
                    dualstack_ipv6=address[0] == '::' and socket.has_dualstack_ipv6(),
                )
            except OSError as error:
                if error.errno not in (EADDRNOTAVAIL, EAFNOSUPPORT):
                    raise
                failed = error  # a name may have addresses that this machine has not
                continue
            listener.setblocking(False)
            self._listeners.append(listener)
            self._loop.add_reader(listener, self._accept, listener)
        if failed and not self._listeners:
            raise failed
        return self._listeners[0].getsockname()[1]

    def close(self) -> None:
        """Listen no longer, and let every stranger go."""
        for listener in self._listeners:
            self._loop.remove_reader(listener)
            listener.close()
        self._listeners.clear()
        for task in self._entering:
            task.cancel()
        for stranger in list(self._strangers):
            stranger.abort()
        self._quiet.make_room(len(self._quiet))

    async def end(self) -> None:
        """Break off what is open still: over TLS a farewell may wait for an answer."""
        for connection in list(self._connections.values()):
            connection.abort()
        while self._connections:
            await asyncio.sleep(0)

    def connection(self, request: web.Request) -> Connection:
        """Return what a request came over; a `ConnectionError` if that has ended."""
        transport = request.transport
        if transport and (connection := self._connections.get(transport)):
            return connection
        raise ConnectionResetError('the client has left')

    def know(self, connection: Connection) -> None:
        """Let a connection stay for as long as it likes."""
        connection.lift_deadline()
        self._strangers.pop(connection, None)

    def entered(self, connection: Connection) -> None:
        """Count a connection that was made."""
        self._connections[connection.transport] = connection
        self._strangers[connection] = connection.source

    def left(self, connection: Connection) -> None:
        """Forget a connection that was lost."""
        self._connections.pop(connection.transport, None)
        self._strangers.pop(connection, None)

    def _accept(self, listener: socket.socket) -> None:
        for _ in range(_AT_ONCE):
            try:
                taken, (address, *_) = listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:
                self._faults.add(error)
                if self._quiet:
                    self._quiet.make_room(_AT_ONCE)
                elif self._strangers:
                    self._make_room(_AT_ONCE)  # which is there when this is called again
                else:
                    self._loop.remove_reader(listener)
                    self._loop.call_later(_PAUSE_S, self._resume, listener)
                return
            taken.setblocking(False)
            self._quiet.add(taken, source_of(address))

    def _resume(self, listener: socket.socket) -> None:
        if listener in self._listeners:
            self._loop.add_reader(listener, self._accept, listener)

    def _admit(self, taken: socket.socket, source: str) -> bool:
        """Make a connection of a socket, unless its source has made too many."""
        if not self._allowances.take(source, self._loop.time()):
            return False
        self._make_room(len(self._strangers) + 1 - MAX_STRANGERS)
        for oldest in islice(self._entering, max(0, len(self._entering) + 1 - MAX_ENTERING)):
            oldest.cancel()
        entering = self._loop.create_task(self._enter(taken, source))
        self._entering[entering] = None
        entering.add_done_callback(lambda task: self._entered(task, taken))
        return True

    def _entered(self, entering: asyncio.Task, taken: socket.socket) -> None:
        del self._entering[entering]
        if entering.cancelled():
            taken.close()  # which nobody has done if it had not begun

    async def _enter(self, taken: socket.socket, source: str) -> None:
        """Make a connection of a socket; who fails in the handshake just goes."""
        with suppress(OSError):
            await self._loop.connect_accepted_socket(
                lambda: Connection(self, source, self._serve()),
                taken,
                ssl=self._tls,
                ssl_handshake_timeout=ANSWERED_WITHIN_S if self._tls else None,
            )

    def _make_room(self, count: int) -> None:
        """Let strangers go, the oldest of the source that has the most."""
        for _ in range(min(count, len(self._strangers))):
            oldest = oldest_of_most(self._strangers)
            del self._strangers[oldest]
            oldest.abort()
