"""Handing things to a slower thread: only the newest wait."""

from collections import deque
from collections.abc import Callable
from threading import Condition, Thread
from typing import Any


class LatestOnlyWorker:
    """A thread that does something with the newest things put in, and never falls behind.

    Attributes
    ----------
    dropped
        Things that newer ones replaced before their turn.
    """

    def __init__(self, work: Callable[[Any], None], name: str, waiting: int = 1):
        """Start; so many things may be `waiting` while one is in work."""
        self.dropped = 0
        self._work = work
        self._waiting = deque(maxlen=waiting)
        self._is_stopped = False
        self._changed = Condition()
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def put(self, thing: Any) -> None:
        """Have a thing worked on, in place of the oldest where too many wait."""
        with self._changed:
            self.dropped += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(thing)
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
                self._changed.wait_for(lambda: self._is_stopped or self._waiting)
                if self._is_stopped:
                    return
                thing = self._waiting.popleft()
            self._work(thing)
