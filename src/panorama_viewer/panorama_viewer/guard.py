"""Who may ask the viewer's server for what."""

import hmac
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

SUBPROTOCOL = 'panorama'
"""What the page's WebSocket speaks."""
_TOKEN_PROTOCOL = 'token.'
"""A page can give its WebSocket no header but a second protocol: this, and then the token."""


class Guard:
    """Refuses what other sites could make a browser ask for, and who has not the token.

    Attributes
    ----------
    token : str
        What looking and the buttons need; empty where only this machine can look.
    """

    def __init__(self, host: str, token: str, *, is_public: bool, is_certified: bool):
        """Set up.

        Parameters
        ----------
        host, token
            As of the settings, and what others have to know.
        is_public
            Whether all may look.
        is_certified
            Whether a certificate that others issued says under which names this machine is found:
            no other site has it, so a browser comes under no strange name.
        """
        self.token, self._is_public, self._is_certified = token, is_public, is_certified
        name = socket.gethostname().lower()
        self._names = {host.lower(), 'localhost', name, f'{name}.local'}

    def has_token(self, request: web.Request) -> bool:
        """Return whether a request brings the token."""
        offered = _protocols(request)
        given = [request.headers.get('X-Token', '')]
        given += [
            word.removeprefix(_TOKEN_PROTOCOL)
            for word in offered
            if word.startswith(_TOKEN_PROTOCOL)
        ]
        token = self.token.encode()
        return bool(token) and any(
            hmac.compare_digest(word.encode(errors='replace'), token) for word in given
        )

    def may_look(self, request: web.Request) -> bool:
        """Return whether a request may see the picture."""
        return not self.token or self._is_public or self.has_token(request)

    def check_token(self, request: web.Request) -> None:
        """Refuse a button pressed without the token."""
        if self.token and not self.has_token(request):
            raise web.HTTPForbidden(
                text='the button needs the token that was printed when the viewer started'
            )

    def check_protocol(self, request: web.Request) -> None:
        """Refuse a WebSocket that speaks something else."""
        if (offered := _protocols(request)) and SUBPROTOCOL not in offered:
            raise web.HTTPBadRequest(text=f'expected the WebSocket protocol {SUBPROTOCOL}')

    @web.middleware
    async def check(self, request: web.Request, handler) -> web.StreamResponse:
        """Refuse a request under a strange name, or from another site's page.

        A site that has its name lead here (DNS rebinding) gives itself away by that name.
        """
        if not self._is_certified and not self._is_ours(request.host):
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


def offers(request: web.Request, word: str) -> bool:
    """Return whether a page's WebSocket offers a word beside the protocol."""
    return word in _protocols(request)


def _protocols(request: web.Request) -> list[str]:
    """Return the protocols that a WebSocket offers."""
    header = request.headers.get('Sec-WebSocket-Protocol', '')
    return [word.strip() for word in header.split(',') if word.strip()]
