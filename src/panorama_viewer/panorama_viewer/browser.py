"""One browser that looks at the panorama, and what it has been sent."""

import asyncio
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from aiohttp import WSCloseCode, web

from fisheye_core.errors import VideoError
from panorama_viewer.connection import Connection
from panorama_viewer.feeds import JpegFeed, TimedJpeg, VideoFeed
from panorama_viewer.projection import Quaternion
from panorama_viewer.way import Way

DRAWN, HEARD = 'drawn', 'heard'
"""What a browser says when it has drawn a picture, and when it has heard the state."""
RESTART, JPEG = 'h264', 'jpeg'
"""What it says when its decoder cannot go on, and when it gives H.264 up."""
SILENT_S = 30.0
"""Over a link on which a picture takes longer nobody can drive; a page that is hidden has left."""
_FAREWELL_S = 1.0
"""What a browser that takes nothing more may hold its end up."""


class Browser:
    """Sends state as it changes, and the newest picture whenever it takes another one.

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
        video: Callable[[], VideoFeed] | None,
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
        video
            Returns its H.264, or raises a `VideoError`; None for a browser that wants JPEG.
        is_known
            Whether it has shown the token.
        """
        self.is_known = is_known
        self._stream, self._connection = stream, connection
        self._state, self._picture = state, picture
        self._news, self._is_over = asyncio.Event(), asyncio.Event()
        self._reason = self._no_video = ''
        self._feed: JpegFeed | VideoFeed = JpegFeed()
        if video:
            try:
                self._feed = video()
            except VideoError as error:
                self._no_video = str(error)
        self._told: dict[str, Any] | None = None
        self._seen: TimedJpeg | None = None
        self._turned: Quaternion | None = None
        self._under_way: deque[TimedJpeg] = deque()
        self._way = Way()
        self._silence: asyncio.TimerHandle | None = None
        self._words = {
            DRAWN: self._drawn,
            HEARD: self._heard,
            RESTART: lambda: self._feed.restart(),
            JPEG: self._give_up,
        }

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
        work = self._serve_news, self._hear, self._farewell
        parts = [asyncio.create_task(part()) for part in work]
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

    async def _serve_news(self) -> None:
        with suppress(ConnectionError):  # it has left, which ends `_hear` too
            while True:
                await self._news.wait()
                self._news.clear()
                await self._send_news()

    async def _hear(self) -> None:
        async for message in self._stream:
            if message.data not in self._words:
                reason = f'expected {", ".join(self._words)}'
                code = WSCloseCode.UNSUPPORTED_DATA
                await dismiss(self._stream, self._connection, code, reason)
                return
            self._words[message.data]()

    def _drawn(self) -> None:
        if self._under_way:
            self._feed.drawn(_now_s())
            self._way.drawn(_now_s(), self._under_way.popleft().came_s)
            self._watch_silence()
            self.wake()

    def _heard(self) -> None:
        self._way.heard(_now_s())

    def _give_up(self, reason: str = '') -> None:
        """Go on with JPEG; a reason is for the page to show."""
        self._feed = JpegFeed(len(self._under_way))
        self._no_video, self._told = reason, None
        self.wake()

    async def _farewell(self) -> None:
        await self._is_over.wait()
        code = WSCloseCode.TRY_AGAIN_LATER
        await dismiss(self._stream, self._connection, code, self._reason)

    async def _send_news(self) -> None:
        state = self._state()
        if state is not self._told:
            self._told = state
            self._way.told(_now_s())
            await self._stream.send_json({**state, **self._own_state()})
        picture = self._picture()
        if not picture or picture is self._seen:
            return
        if self._feed.takes(picture, _now_s(), self._connection.unconfirmed()):
            self._seen = picture
            await self._send(picture)

    async def _send(self, picture: TimedJpeg) -> None:
        try:
            data = await self._feed.coded(picture)
        except VideoError as error:
            self._give_up(str(error))
            data = picture.jpeg
        if data:
            self._feed.sent(_now_s(), len(data))
            self._under_way.append(picture)
            self._watch_silence()
            if picture.orientation != self._turned:
                self._turned = picture.orientation
                await self._stream.send_json({'orientation': self._turned})
            await self._stream.send_bytes(data)

    def _own_state(self) -> dict[str, Any]:
        """Return what is true of this browser alone."""
        return {
            'way_ms': round(self._way.usual_s(_now_s()) * 1e3),
            'format': self._feed.name,
            'no_video': self._no_video,
        }

    def _watch_silence(self) -> None:
        """Wait for the next picture to be drawn, if one is under way."""
        self._stop_waiting()
        if self._under_way:
            self._silence = asyncio.get_running_loop().call_later(
                SILENT_S, self.show_out, f'this page has drawn nothing for {SILENT_S:.0f} s'
            )

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
