"""What goes wrong in the server without being meant to: reported once, not a thousand times."""

import asyncio
import traceback
from collections.abc import Callable
from typing import Any

from aiohttp.http_exceptions import HttpProcessingError

_MOST = 20
"""A server with more kinds of faults than that needs no further report."""


class Faults:
    """Reports each kind of fault when it happens first; takes the place of aiohttp's logger.

    Two faults are of one kind if they are of one type and were raised on one line.
    """

    def __init__(self, report: Callable[[str, str], None]):
        """Prepare; `report` takes a sentence and the traceback, in the server's thread."""
        self._report = report
        self._known: set[str] = set()

    def add(self, error: BaseException) -> None:
        """Note an exception; what a client sent is no fault of ours."""
        if isinstance(error, (HttpProcessingError, ConnectionError)):
            return
        lines = traceback.extract_tb(error.__traceback__)
        place = f' in {lines[-1].filename.rpartition("/")[2]}:{lines[-1].lineno}' if lines else ''
        kind = f'{type(error).__name__}{place}'
        if kind not in self._known and len(self._known) < _MOST:
            self._known.add(kind)
            sentence = f'a part of the page failed: {kind}: {error}'
            self._report(sentence, ''.join(traceback.format_exception(error)))

    def exception(self, _: str, *__: Any, exc_info: BaseException) -> None:
        """Note an exception as aiohttp hands it to its logger."""
        self.add(exc_info)

    def debug(self, *_: Any, **__: Any) -> None:
        """Leave out what aiohttp says of clients."""

    def in_loop(self, _: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Note what the event loop hands to its exception handler."""
        if error := context.get('exception'):
            self.add(error)
