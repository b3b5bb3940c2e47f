"""One browser that looks at the panorama, and what it has been sent."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

from aiohttp import WSCloseCode, web

from panorama_viewer.connection import Connection

DRAWN = 'drawn'
"""What a browser says when it has drawn a picture: nothing else is expected from it."""
SILENT_S = 30.0
"""Over a link on which a picture takes longer nobody can drive; a page that is hidden has left."""
_FAREWELL_S = 1.0
"""What a browser that takes nothing more may hold its end up."""


class TimedJpeg(NamedTuple):
    """A JPEG and when it came, s of the event loop's clock."""

    jpeg: bytes
    came_s: float


class Browser:
    """Sends state as it changes, and the newest picture whenever the last one was drawn.

    Attributes
    ----------
    is_known : bool
        Whether it has shown the token.
    """

    def __init__(
        self,
        stream: web.WebSocketResponse,
        connection: Connection,
        state: Callable[[], dict[str, Any]],
        picture: Callable[[], TimedJpeg | None],
        *,
        is_known: bool,
    ):
        """Prepare; `serve` runs until the browser leaves.

        Parameters
        ----------
        stream, connection
            The WebSocket, and what it runs over.
        state, picture
            Return the newest of each; None for no picture.
        is_known
            Whether it has shown the token.
        """
        self.is_known = is_known
        self._stream, self._connection = stream, connection
        self._state, self._picture = state, picture
        self._news, self._is_over = asyncio.Event(), asyncio.Event()
        self._reason = ''
        self._is_ready = True
        self._told: dict[str, Any] | None = None
        self._sent: TimedJpeg | None = None
        self._sent_s = self._way_s = 0.0
        self._silence: asyncio.TimerHandle | None = None

    def wake(self) -> None:
        """Announce a new picture or state."""
        self._news.set()

    def show_out(self, reason: str) -> None:
        """End its visit for a reason that the page shows."""
        self._reason = reason
        self._is_over.set()

    async def serve(self) -> None:
        """Serve until the browser leaves or is shown out."""
        self.wake()
        parts = [asyncio.create_task(part()) for part in (self._feed, self._hear, self._farewell)]
        try:
            ended, _ = await asyncio.wait(parts, return_when=asyncio.FIRST_COMPLETED)
            for part in ended:
                part.result()
        finally:
            self._stop_waiting()
            for part in parts:
                part.cancel()

    async def close(self) -> None:
        """Notify the browser that the viewer ends."""
        await self._stream.close(code=WSCloseCode.GOING_AWAY)

    async def _feed(self) -> None:
        with suppress(ConnectionError):  # it has left, which ends `_hear` too
            while True:
                await self._news.wait()
                self._news.clear()
                await self._send_news()

    async def _hear(self) -> None:
        async for message in self._stream:
            if message.data != DRAWN:
                await dismiss(
                    self._stream,
                    self._connection,
                    WSCloseCode.UNSUPPORTED_DATA,
                    f'expected {DRAWN}',
                )
                return
            if not self._is_ready:
                self._way_s = _now_s() - self._sent_s
                self._stop_waiting()
                self._is_ready = True
                self.wake()

    async def _farewell(self) -> None:
        await self._is_over.wait()
        code = WSCloseCode.TRY_AGAIN_LATER
        await dismiss(self._stream, self._connection, code, self._reason)

    async def _send_news(self) -> None:
        state = self._state()
        if state is not self._told:
            self._told = state
            way_ms = round(self._way_s * 1e3)
            await self._stream.send_json({**state, 'way_ms': way_ms})
        picture = self._picture()
        if self._is_ready and picture and picture is not self._sent:
            self._is_ready, self._sent = False, picture
            self._sent_s = _now_s()
            self._silence = asyncio.get_running_loop().call_later(
                SILENT_S, self.show_out, f'this page has drawn nothing for {SILENT_S:.0f} s'
            )
            await self._stream.send_bytes(picture.jpeg)

    def _stop_waiting(self) -> None:
        if self._silence:
            self._silence.cancel()


async def dismiss(
    stream: web.WebSocketResponse, connection: Connection, code: WSCloseCode, reason: str
) -> None:
    """Close a WebSocket for a reason; its connection ends soon whether it answers or not."""
    connection.set_deadline(_FAREWELL_S)
    await stream.close(code=code, message=reason.encode())


def _now_s() -> float:
    return asyncio.get_running_loop().time()
