"""Handing things to a slower thread: only the newest waits."""

from collections.abc import Callable
from threading import Condition, Thread
from typing import Any


class Newest:
    """A thread that does something with the newest thing put in, and never falls behind.

    Attributes
    ----------
    dropped
        Things that a newer one replaced before their turn.
    """

    def __init__(self, work: Callable[[Any], None], name: str):
        self.dropped = 0
        self._work = work
        self._next = None
        self._is_stopped = False
        self._changed = Condition()
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, thing: Any) -> None:
        """Have a thing worked on next, in place of one that still waits."""
        with self._changed:
            self.dropped += self._next is not None
            self._next = thing
            self._changed.notify()

    def stop(self) -> None:
        """Finish what is in work, and no more."""
        with self._changed:
            self._is_stopped = True
            self._changed.notify()
        self._thread.join()

    def _run(self):
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._is_stopped or self._next is not None)
                if self._is_stopped:
                    return
                thing, self._next = self._next, None
            self._work(thing)
