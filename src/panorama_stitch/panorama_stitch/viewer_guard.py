"""Who may ask the viewer's server for what."""

import hmac
import secrets
import socket
from ipaddress import ip_address
from urllib.parse import urlsplit

from aiohttp import web

HEADERS = {
    'Content-Security-Policy': "default-src 'self'; frame-ancestors 'none'; base-uri 'none'",
    'X-Content-Type-Options': 'nosniff',
    'Referrer-Policy': 'no-referrer',
    'Cache-Control': 'no-cache',
}
"""With every answer: the page loads nothing from elsewhere and nobody frames it."""


class Guard:
    """Refuses what other sites could make a browser ask for, and buttons without the token.

    Attributes
    ----------
    token : str
        What the buttons need; empty where only this machine can look.
    """

    def __init__(self, host: str):
        self.token = '' if _is_loopback(host) else secrets.token_urlsafe(9)
        name = socket.gethostname().lower()
        self._names = {host.lower(), 'localhost', name, f'{name}.local'}

    def check_token(self, request: web.Request) -> None:
        """Refuse a button pressed without the token."""
        given = request.headers.get('X-Token', '').encode(errors='replace')
        if self.token and not hmac.compare_digest(given, self.token.encode()):
            raise web.HTTPForbidden(
                text='the button needs the token that was printed when the viewer started'
            )

    @web.middleware
    async def check(self, request: web.Request, handler) -> web.StreamResponse:
        """Refuse a request under a strange name, or from another site's page.

        A site that has its name lead here (DNS rebinding) gives itself away by that name.
        """
        if not self._is_ours(request.host):
            raise web.HTTPForbidden(
                text=f'{request.host!r:.100} is not this machine; expected its address'
            )
        origin = request.headers.get('Origin')
        if origin is not None and origin.partition('://')[2] != request.host:
            raise web.HTTPForbidden(text=f'{origin!r:.100} is another site')
        return await handler(request)

    def _is_ours(self, host: str) -> bool:
        try:
            name = urlsplit(f'//{host}').hostname or ''
            return name in self._names or bool(ip_address(name))
        except ValueError:
            return False


def _is_loopback(host: str) -> bool:
    try:
        return host == 'localhost' or ip_address(host).is_loopback
    except ValueError:
        return False
