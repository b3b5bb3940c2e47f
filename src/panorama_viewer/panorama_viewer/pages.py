"""The files of the viewer's page, read once: no other file can be asked for."""

from collections.abc import Awaitable, Callable
from importlib.resources import files

from aiohttp import web

Handler = Callable[[web.Request], Awaitable[web.Response]]

_TYPES = {
    'css': 'text/css',
    'html': 'text/html',
    'js': 'text/javascript',
    'svg': 'image/svg+xml',
}


def pages() -> dict[str, Handler]:
    """Return what answers each path of the page."""
    web_files = files('panorama_viewer') / 'web'
    answers = {
        f'/{path.name}': page(_TYPES[path.name.rpartition('.')[2]], path.read_bytes(), 'utf-8')
        for path in web_files.iterdir()
    }
    return {'/': answers['/index.html'], **answers}


def page(content_type: str, body: bytes, charset: str | None = None) -> Handler:
    """Return what answers with the same bytes each time."""

    async def answer(_: web.Request) -> web.Response:
        return web.Response(body=body, content_type=content_type, charset=charset)

    return answer
