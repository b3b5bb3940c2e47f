"""One connection to the server, with bounds on its time and on what it sends."""

from __future__ import annotations

import asyncio
import fcntl
import sys
from contextlib import suppress
from termios import TIOCOUTQ
from typing import Protocol

from panorama_viewer.allowance import Allowance

ANSWERED_WITHIN_S = 10.0
"""From the connection to the end of the answer; pages are small."""
_BURST, _PER_S = 16_384, 2_048.0
"""Bytes: a request with its headers; then eleven for each picture that was drawn."""


class Keeper(Protocol):
    """What counts connections."""

    def entered(self, connection: Connection) -> None:
        """Count one that was made."""

    def left(self, connection: Connection) -> None:
        """Forget one that was lost."""


class Connection(asyncio.Protocol):
    """Hands bytes on to what serves them.

    Attributes
    ----------
    source : str
        Where it comes from.
    transport : asyncio.Transport
        Once it is made.
    """

    transport: asyncio.Transport

    def __init__(self, keeper: Keeper, source: str, served: asyncio.Protocol):
        self.source = source
        self._keeper, self._served = keeper, served
        self._loop = asyncio.get_running_loop()
        self._bytes = Allowance(_BURST, _PER_S, self._loop.time())
        self._deadline: asyncio.TimerHandle | None = None

    def set_deadline(self, seconds: float) -> None:
        """End the connection after so long, in place of an earlier deadline."""
        self.lift_deadline()
        self._deadline = self._loop.call_later(seconds, self.abort)

    def lift_deadline(self) -> None:
        """Let it last."""
        if self._deadline:
            self._deadline.cancel()

    def abort(self) -> None:
        """End it at once, whatever is still to be sent."""
        self.transport.abort()

    def unconfirmed(self) -> int:
        """Return how many bytes the other machine has not confirmed; 0 where nobody can tell.

        Raises
        ------
        ConnectionResetError
            If the connection has ended.
        """
        if self.transport.is_closing():
            raise ConnectionResetError('the client has left')
        reply = bytes(4)
        with suppress(OSError):
            reply = fcntl.ioctl(self.transport.get_extra_info('socket'), TIOCOUTQ, reply)
        return self.transport.get_write_buffer_size() + int.from_bytes(reply, sys.byteorder)

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin."""
        self.transport = transport
        self.set_deadline(ANSWERED_WITHIN_S)
        self._keeper.entered(self)
        self._served.connection_made(transport)

    def data_received(self, data: bytes) -> None:
        """Pass bytes on as long as they are no more than a page would send."""
        if self._bytes.take(len(data), self._loop.time()):
            self._served.data_received(data)
        else:
            self.abort()

    def eof_received(self) -> bool | None:
        """Handle the end of the input."""
        return self._served.eof_received()

    def connection_lost(self, error: Exception | None) -> None:
        """End."""
        self.lift_deadline()
        self._keeper.left(self)
        self._served.connection_lost(error)

    def pause_writing(self) -> None:
        """Pause writing."""
        self._served.pause_writing()

    def resume_writing(self) -> None:
        """Resume writing."""
        self._served.resume_writing()
