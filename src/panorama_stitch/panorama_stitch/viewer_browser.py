"""One browser that looks at the panorama, and what it has been sent."""

import asyncio
from collections.abc import Callable
from typing import Any, NamedTuple

from aiohttp import WSCloseCode, web

DRAWN = 'drawn'
"""What a browser says when it has drawn a picture: nothing else is expected from it."""


class Picture(NamedTuple):
    """A JPEG and when it came, s of the event loop's clock."""

    jpeg: bytes
    came_s: float


class Browser:
    """Sends state as it changes, and the newest picture whenever the last one was drawn."""

    def __init__(
        self,
        stream: web.WebSocketResponse,
        state: Callable[[], dict[str, Any]],
        picture: Callable[[], Picture | None],
    ):
        """Prepare; `serve` runs until the browser leaves.

        Parameters
        ----------
        stream
            The WebSocket.
        state, picture
            Give the newest of each; None for no picture.
        """
        self._stream = stream
        self._state, self._picture = state, picture
        self._news = asyncio.Event()
        self._is_ready = True
        self._told: dict[str, Any] | None = None
        self._sent: Picture | None = None
        self._sent_s = self._way_s = 0.0

    def wake(self) -> None:
        """Say that there is a new picture or state."""
        self._news.set()

    async def serve(self) -> None:
        """Serve until the browser leaves."""
        self.wake()
        feeding = asyncio.create_task(self._feed())
        try:
            async for message in self._stream:
                if message.data != DRAWN:
                    await self._stream.close(code=WSCloseCode.UNSUPPORTED_DATA)
                    return
                self._way_s = _now_s() - self._sent_s
                self._is_ready = True
                self.wake()
        finally:
            feeding.cancel()

    async def close(self) -> None:
        """Tell the browser that the viewer ends."""
        await self._stream.close(code=WSCloseCode.GOING_AWAY)

    async def _feed(self) -> None:
        try:
            while True:
                await self._news.wait()
                self._news.clear()
                await self._send_news()
        except ConnectionError:
            pass  # it has left, which ends `serve` too

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
            await self._stream.send_bytes(picture.jpeg)


def _now_s() -> float:
    return asyncio.get_running_loop().time()
