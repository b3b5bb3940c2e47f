"""The web server of the viewer: one page, and the newest picture for each browser.

It runs in a thread of its own and knows nothing of ROS. A browser gets the next picture when it
has drawn the last one, and always the newest: a slow one sees fewer pictures, none an old one.
"""

import asyncio
import errno
import socket
from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Any

from aiohttp import WSCloseCode, web

from fisheye_geometry.errors import FisheyeError, SettingError
from panorama_stitch.viewer_browser import Browser, Picture
from panorama_stitch.viewer_guard import HEADERS, Guard
from panorama_stitch.viewer_pages import pages
from panorama_stitch.viewer_settings import ViewerSettings

_CLOSE_S = 1.0
"""What a browser that does not answer may hold up the end."""
_HEARTBEAT_S = 5.0
_LONGEST_WORD = 64
_CALIBRATION_TIMEOUT_S = 60.0


class ViewerServer:
    """Serves the page to browsers.

    Attributes
    ----------
    url : str
        What to open, once `start` has returned; with the token if the buttons need one.
    """

    def __init__(
        self,
        settings: ViewerSettings,
        *,
        calibrate: Callable[[], Future],
        watched: Callable[[], None],
    ):
        """Prepare; `start` serves.

        Parameters
        ----------
        settings
            Where to serve and to how many.
        calibrate
            Called when somebody presses the button; gives a future of the sentence to show. A
            `FisheyeError` is shown in its place.
        watched
            Called when the first browser comes and when the last one has left. Both are called
            in the server's thread.
        """
        self.url = ''
        self._settings = settings
        self._calibrate, self._watched = calibrate, watched
        self._guard = Guard(settings.host)
        self._browsers: set[Browser] = set()
        self._picture: Picture | None = None
        self._state: dict[str, Any] = {
            'stale_after_s': settings.stale_after_s,
            'needs_token': bool(self._guard.token),
        }
        self._loop = asyncio.new_event_loop()
        self._thread = Thread(target=self._loop.run_forever, name='viewer', daemon=True)
        self._runner: web.AppRunner | None = None

    @property
    def watchers(self) -> int:
        """How many browsers look."""
        return len(self._browsers)

    def start(self) -> None:
        """Serve from now on.

        Raises
        ------
        SettingError
            If the address cannot be had.
        """
        self._thread.start()
        try:
            asyncio.run_coroutine_threadsafe(self._open(), self._loop).result()
        # A name that cannot even be looked up is a ValueError.
        except (OSError, ValueError) as error:
            self.stop()
            raise SettingError(_refusal(self._settings, error)) from error

    def stop(self) -> None:
        """Say goodbye to every browser and end the thread."""
        if self._loop.is_closed():
            return
        asyncio.run_coroutine_threadsafe(self._close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def show(self, jpeg: bytes) -> None:
        """Show a picture in every browser that is ready for one."""
        self._loop.call_soon_threadsafe(self._show, jpeg)

    def tell(self, **state: Any) -> None:
        """Change parts of the state that the pages show: what JSON can hold."""
        self._loop.call_soon_threadsafe(self._tell, state)

    async def _open(self) -> None:
        app = web.Application(middlewares=[self._guard.check])
        app.on_response_prepare.append(_add_headers)
        app.router.add_get('/live', self._live)
        app.router.add_post('/calibrate', self._calibration)
        app.router.add_post('/snapshot', self._snapshot)
        for path, page in pages().items():
            app.router.add_get(path, page)
        self._runner = web.AppRunner(app, access_log=None, shutdown_timeout=_CLOSE_S)
        await self._runner.setup()
        site = web.TCPSite(self._runner, self._settings.host, self._settings.port)
        await site.start()
        port = self._runner.addresses[0][1]
        token = f'#token={self._guard.token}' if self._guard.token else ''
        self.url = f'http://{_reachable(self._settings.host)}:{port}/{token}'

    async def _close(self) -> None:
        for browser in list(self._browsers):
            await browser.close()
        if self._runner:
            await self._runner.cleanup()

    def _show(self, jpeg: bytes) -> None:
        self._picture = Picture(jpeg, self._loop.time())
        self._wake()

    def _tell(self, state: dict[str, Any]) -> None:
        self._state = {**self._state, **state}
        self._wake()

    def _wake(self) -> None:
        for browser in self._browsers:
            browser.wake()

    def _fresh(self) -> Picture | None:
        """Give the newest picture if it is not stale."""
        picture = self._picture
        if picture and self._loop.time() - picture.came_s < self._settings.stale_after_s:
            return picture
        return None

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        stream = web.WebSocketResponse(
            heartbeat=_HEARTBEAT_S, max_msg_size=_LONGEST_WORD, compress=False, timeout=_CLOSE_S
        )
        await stream.prepare(request)
        if len(self._browsers) >= self._settings.max_clients:
            sentence = f'{len(self._browsers)} browsers look already, which is the limit'
            await stream.close(code=WSCloseCode.TRY_AGAIN_LATER, message=sentence.encode())
            return stream
        browser = Browser(stream, lambda: self._state, self._fresh)
        self._browsers.add(browser)
        if len(self._browsers) == 1:
            self._picture = None
            self._watched()
        try:
            await browser.serve()
        finally:
            self._browsers.discard(browser)
            if not self._browsers:
                self._watched()
        return stream

    async def _calibration(self, request: web.Request) -> web.Response:
        """Have the overlap measured and say how it went."""
        self._guard.check_token(request)
        try:
            waiting = asyncio.wrap_future(self._calibrate())
            return web.Response(text=await asyncio.wait_for(waiting, _CALIBRATION_TIMEOUT_S))
        except FisheyeError as error:
            return web.Response(status=503, text=str(error))
        except asyncio.TimeoutError:
            return web.Response(status=504, text='nothing was measured: there was no answer')

    async def _snapshot(self, request: web.Request) -> web.Response:
        self._guard.check_token(request)
        picture = self._fresh()
        if picture is None:
            return web.Response(status=503, text='there is no picture to save')
        return web.Response(body=picture.jpeg, content_type='image/jpeg')


async def _add_headers(_: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(HEADERS)


def _reachable(host: str) -> str:
    """Give the address under which others find a server that listens on `host`."""
    if host not in ('0.0.0.0', '::'):
        return f'[{host}]' if ':' in host else host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Nothing is sent: it only asks which of our addresses faces the network.
            probe.connect(('192.0.2.1', 9))
            return probe.getsockname()[0]
        except OSError:
            return socket.gethostname()


def _refusal(settings: ViewerSettings, error: OSError | ValueError) -> str:
    where = f'port {settings.port} of {settings.host}'
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return f'{where} is in use by another program; set the parameter port to a free one'
    return f'cannot serve on {where}: {getattr(error, "strerror", None) or error}'
