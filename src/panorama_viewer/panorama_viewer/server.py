"""The web server of the viewer: one page, and the newest picture for each browser.

It runs in a thread of its own and knows nothing of ROS. A browser gets the next picture when it
has drawn the last one, and always the newest: a slow one sees fewer pictures, none an old one.
"""

import asyncio
from collections.abc import Callable
from concurrent.futures import Future
from threading import Thread
from typing import Any

from aiohttp import web

from fisheye_core.errors import SettingError
from panorama_viewer.address import reachable, refusal
from panorama_viewer.faults import Faults
from panorama_viewer.gate import Gate
from panorama_viewer.projection import Quaternion
from panorama_viewer.settings import ViewerSettings
from panorama_viewer.site import Site
from panorama_viewer.tls import Tls

_SHUTDOWN_S = 1.0
"""What a request that is not answered may hold up the end."""


class ViewerServer:
    """Serves the page to browsers.

    Attributes
    ----------
    address, url : str
        Where it serves, once `start` has returned; and what to open: the same, with the token if
        one is needed.
    """

    def __init__(
        self,
        settings: ViewerSettings,
        *,
        calibrate: Callable[[], Future],
        watched: Callable[[], None],
        report: Callable[[str, str], None],
        tls: Tls | None = None,
    ):
        """Prepare; `start` serves.

        Parameters
        ----------
        settings
            Where to serve and to how many.
        calibrate
            Called when somebody presses the button; returns a future of the sentence to show. A
            `FisheyeError` is shown in its place.
        watched
            Called when the first browser comes and when the last one has left.
        report
            Called with a sentence and a traceback when a part of the server fails, once for each
            kind of fault. All three are called in the server's thread.
        tls
            How to encrypt; None: not at all.

        Raises
        ------
        SettingError
            If `token_file` cannot be used.
        """
        self.address = self.url = ''
        self._settings = settings
        self._tls = tls
        self._site = Site(settings, calibrate, watched, tls)
        self._faults = Faults(report)
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(self._faults.in_loop)
        self._thread = Thread(target=self._loop.run_forever, name='viewer', daemon=True)
        self._runner: web.AppRunner | None = None
        self._gate: Gate | None = None

    @property
    def watchers(self) -> int:
        """How many browsers look."""
        return len(self._site.browsers)

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
            settings = self._settings
            raise SettingError(refusal(settings.host, settings.port, error)) from error

    def stop(self) -> None:
        """Close every connection and end the thread."""
        if self._loop.is_closed():
            return
        asyncio.run_coroutine_threadsafe(self._close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    def show(self, jpeg: bytes, orientation: Quaternion | None = None) -> None:
        """Show a picture in every browser that is ready for one; turned so it is level."""
        self._loop.call_soon_threadsafe(self._site.show, jpeg, orientation)

    def apply(self, settings: ViewerSettings) -> None:
        """Apply the settings that can change while it runs."""
        self._loop.call_soon_threadsafe(self._site.apply, settings)

    def tell(self, **state: Any) -> None:
        """Change parts of the state that the pages show: what JSON can hold."""
        self._loop.call_soon_threadsafe(self._site.tell, state)

    async def _open(self) -> None:
        self._gate = Gate(self._faults, self._tls.context if self._tls else None)
        self._runner = web.AppRunner(
            self._site.application(self._gate),
            access_log=None,
            logger=self._faults,
            shutdown_timeout=_SHUTDOWN_S,
        )
        await self._runner.setup()
        host, token = self._settings.host, self._site.token
        serve: Any = self._runner.server  # there since `setup`
        port = await self._gate.open(host, self._settings.port, serve)
        scheme = 'https' if self._tls else 'http'
        self.address = f'{scheme}://{reachable(host)}:{port}/'
        self.url = self.address + (f'#token={token}' if token else '')

    async def _close(self) -> None:
        if self._gate:
            self._gate.close()
        await self._site.close()
        if self._runner:
            await self._runner.cleanup()
        if self._gate:
            await self._gate.end()
