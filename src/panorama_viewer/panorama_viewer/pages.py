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
        f'/{path.name}': _page(path.name, path.read_bytes()) for path in web_files.iterdir()
    }
    return {'/': answers['/index.html'], **answers}


def _page(name: str, body: bytes) -> Handler:
    content_type = _TYPES[name.rpartition('.')[2]]

    async def answer(_: web.Request) -> web.Response:
        return web.Response(body=body, content_type=content_type, charset='utf-8')

    return answer
