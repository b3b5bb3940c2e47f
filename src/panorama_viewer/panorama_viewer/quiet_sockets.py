"""Sockets that were accepted and have sent nothing yet: they cost a descriptor and no more."""

import asyncio
import socket
from collections import Counter
from collections.abc import Callable, Mapping
from typing import TypeVar

from panorama_viewer.connection import ANSWERED_WITHIN_S

_Key = TypeVar('_Key')

MAX_QUIET = 256
_REFUSED_S = 1.0
"""How long who is refused is held: who is told at once is back at once, again and again, and
others of the same address hardly get a turn."""


class QuietSockets:
    """Holds sockets until they send something or their time has passed.

    Browsers send a request, or a greeting of TLS, at once; what stays silent must not take the
    room of those.
    """

    def __init__(self, admit: Callable[[socket.socket, str], bool]):
        """Begin empty.

        Parameters
        ----------
        admit
            Gets a socket and its source once something is there to be read; returns whether it
            took it over. One that it refuses is held a little longer, then closed.
        """
        self._admit = admit
        self._loop = asyncio.get_running_loop()
        self._sources: dict[socket.socket, str] = {}
        self._deadlines: dict[socket.socket, asyncio.TimerHandle] = {}

    def __len__(self) -> int:
        return len(self._sources)

    def add(self, taken: socket.socket, source: str) -> None:
        """Hold a socket that does not block; where there are too many, close another one."""
        self.make_room(len(self) + 1 - MAX_QUIET)
        self._sources[taken] = source
        self._deadlines[taken] = self._loop.call_later(ANSWERED_WITHIN_S, self._close, taken)
        self._loop.add_reader(taken, self._heard, taken)

    def make_room(self, count: int) -> None:
        """Close so many, each the oldest of the source that has the most."""
        for _ in range(min(count, len(self))):
            self._close(oldest_of_most(self._sources))

    def _heard(self, taken: socket.socket) -> None:
        self._deadlines.pop(taken).cancel()
        self._loop.remove_reader(taken)
        if self._admit(taken, self._sources[taken]):
            del self._sources[taken]
        else:
            self._deadlines[taken] = self._loop.call_later(_REFUSED_S, self._close, taken)

    def _close(self, taken: socket.socket) -> None:
        self._deadlines.pop(taken).cancel()
        self._loop.remove_reader(taken)
        del self._sources[taken]
        taken.close()


def oldest_of_most(sources: Mapping[_Key, str]) -> _Key:
    """Return the first key of the source that has the most keys."""
    ((most, _),) = Counter(sources.values()).most_common(1)
    return next(key for key, source in sources.items() if source == most)
