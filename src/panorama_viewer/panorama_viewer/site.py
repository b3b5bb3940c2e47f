"""What the web server answers: the page, the pictures, the buttons."""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

from aiohttp import WSCloseCode, web

from fisheye_core.errors import FisheyeError
from panorama_viewer.address import is_loopback
from panorama_viewer.audience import Audience
from panorama_viewer.browser import RESTART, Browser, dismiss
from panorama_viewer.feeds import TimedJpeg, VideoFeed
from panorama_viewer.gate import Gate
from panorama_viewer.guard import HEADERS, SUBPROTOCOL, Guard, offers
from panorama_viewer.pages import page, pages
from panorama_viewer.projection import Quaternion
from panorama_viewer.settings import ViewerSettings
from panorama_viewer.tls import Tls
from panorama_viewer.token import kept_token, new_token

_CLOSE_S = 1.0
"""What a browser that does not answer may hold up the end."""
_HEARTBEAT_S = 5.0
_LONGEST_WORD = 64
_CALIBRATION_TIMEOUT_S = 60.0
_SAVING_S = 60.0
"""For a picture over a slow link."""


class Site:
    """Answers requests and feeds the browsers that look; everything happens in one event loop.

    Attributes
    ----------
    browsers : Audience
        Those that look.
    token : str
        What looking and the buttons need; empty if they need none.
    """

    def __init__(
        self,
        settings: ViewerSettings,
        calibrate: Callable[[], Future],
        watched: Callable[[], None],
        tls: Tls | None = None,
    ):
        """Prepare; the parameters are those of `ViewerServer`.

        Raises
        ------
        SettingError
            If `token_file` cannot be used.
        """
        self.token = _token(settings)
        self.browsers = Audience(settings.max_clients, self._audience_changed)
        self._calibrate, self._watched = calibrate, watched
        self._certificate = tls.own if tls else b''
        self._guard = Guard(
            settings.host,
            self.token,
            is_public=settings.public,
            is_certified=tls is not None and not tls.own,
        )
        self._settings = settings
        self._worker = ThreadPoolExecutor(1, 'encode')
        self._picture: TimedJpeg | None = None
        self._state: dict[str, Any] = {
            'stale_after_s': settings.stale_after_s,
            'needs_token': bool(self.token),
        }

    def application(self, gate: Gate) -> web.Application:
        """Return what serves the requests that come through a gate."""
        self._gate = gate
        app = web.Application(middlewares=[self._guard.check])
        app.on_response_prepare.append(_add_headers)
        app.router.add_get('/live', self._live)
        app.router.add_post('/calibrate', self._calibration)
        app.router.add_post('/snapshot', self._snapshot)
        for path, answer in pages().items():
            app.router.add_get(path, answer)
        if self._certificate:
            answer = page('application/x-x509-ca-cert', self._certificate)
            app.router.add_get('/certificate.crt', answer)
        return app

    def show(self, jpeg: bytes, orientation: Quaternion | None = None) -> None:
        """Show a picture in every browser that is ready for one; turned so it is level."""
        self._picture = TimedJpeg(jpeg, asyncio.get_running_loop().time(), orientation)
        self._wake()

    def apply(self, settings: ViewerSettings) -> None:
        """Apply what can change while it runs: the bit rate."""
        self._settings = settings

    def tell(self, state: dict[str, Any]) -> None:
        """Change parts of the state that the pages show."""
        self._state = {**self._state, **state}
        self._wake()

    async def close(self) -> None:
        """Close the connection to every browser."""
        await asyncio.gather(*(browser.close() for browser in self.browsers))
        self._worker.shutdown(cancel_futures=True)

    def _audience_changed(self) -> None:
        if len(self.browsers):
            self._picture = None
        self._watched()

    def _wake(self) -> None:
        for browser in self.browsers:
            browser.wake()

    def _fresh(self) -> TimedJpeg | None:
        """Return the newest picture if it is not stale."""
        now_s = asyncio.get_running_loop().time()
        if self._picture and now_s - self._picture.came_s < self._settings.stale_after_s:
            return self._picture
        return None

    async def _live(self, request: web.Request) -> web.WebSocketResponse:
        """Show the panorama to a browser that may look, while there is a place."""
        self._guard.check_protocol(request)
        connection = self._gate.connection(request)
        stream = web.WebSocketResponse(
            heartbeat=_HEARTBEAT_S,
            max_msg_size=_LONGEST_WORD,
            compress=False,
            timeout=_CLOSE_S,
            protocols=(SUBPROTOCOL,),
        )
        await stream.prepare(request)
        if not self._guard.may_look(request):
            sentence = 'looking needs the token that was printed when the viewer started'
            await dismiss(stream, connection, WSCloseCode.POLICY_VIOLATION, sentence)
            return stream
        is_known = self._guard.has_token(request)
        video = self._video if offers(request, RESTART) else None
        browser = Browser(
            stream, connection, lambda: self._state, self._fresh, video, is_known=is_known
        )
        if not self.browsers.enter(browser):
            sentence = f'{len(self.browsers)} browsers look already, which is the limit'
            await dismiss(stream, connection, WSCloseCode.TRY_AGAIN_LATER, sentence)
            return stream
        self._gate.know(connection)
        try:
            await browser.serve()
        finally:
            self.browsers.leave(browser)
        return stream

    def _video(self) -> VideoFeed:
        now_s = asyncio.get_running_loop().time()
        return VideoFeed(lambda: self._settings, self._worker, now_s)

    async def _calibration(self, request: web.Request) -> web.Response:
        """Request a calibration and describe its outcome."""
        self._check_button(request, _CALIBRATION_TIMEOUT_S + _CLOSE_S)
        try:
            waiting = asyncio.wrap_future(self._calibrate())
            return web.Response(text=await asyncio.wait_for(waiting, _CALIBRATION_TIMEOUT_S))
        except FisheyeError as error:
            return web.Response(status=503, text=str(error))
        except asyncio.TimeoutError:
            return web.Response(status=504, text='nothing was measured: there was no answer')

    async def _snapshot(self, request: web.Request) -> web.Response:
        self._check_button(request, _SAVING_S)
        picture = self._fresh()
        if picture is None:
            return web.Response(status=503, text='there is no picture to save')
        return web.Response(body=picture.jpeg, content_type='image/jpeg')

    def _check_button(self, request: web.Request, seconds: float) -> None:
        """Refuse who may not press it, and give who may the time for it."""
        self._guard.check_token(request)
        connection = self._gate.connection(request)
        if self._guard.has_token(request):
            self._gate.know(connection)
        connection.set_deadline(seconds)


async def _add_headers(_: web.Request, response: web.StreamResponse) -> None:
    response.headers.update(HEADERS)
    # One request a connection: whoever holds one does so for an answer.
    response.force_close()


def _token(settings: ViewerSettings) -> str:
    if is_loopback(settings.host):
        return ''
    return kept_token(Path(settings.token_file)) if settings.token_file else new_token()
