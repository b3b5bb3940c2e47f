"""Handing items to a slower thread: only the newest ones wait."""

from collections import deque
from collections.abc import Callable
from threading import Condition, Thread
from typing import Generic, TypeVar

from fisheye_core.background import bug_of
from fisheye_core.errors import FisheyeError

_Item = TypeVar('_Item')


class LatestOnlyQueue(Generic[_Item]):
    """A queue that never falls behind: where too many items wait, the oldest is dropped.

    Attributes
    ----------
    dropped : int
        Items that newer ones replaced before their turn.
    """

    def __init__(self, waiting: int = 1):
        """Start empty; at most `waiting` items wait."""
        self.dropped = 0
        self._waiting: deque[_Item] = deque(maxlen=waiting)
        self._is_closed = False
        self._changed = Condition()

    def put(self, item: _Item) -> None:
        """Add an item, in place of the oldest where too many wait."""
        with self._changed:
            self.dropped += len(self._waiting) == self._waiting.maxlen
            self._waiting.append(item)
            self._changed.notify()

    def get(self) -> _Item | None:
        """Wait for the oldest item; return None once the queue is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or self._waiting)
            return None if self._is_closed else self._waiting.popleft()

    def clear(self) -> None:
        """Drop what waits, uncounted."""
        with self._changed:
            self._waiting.clear()

    def close(self) -> None:
        """Make each `get`, now and later, return None."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()


class LatestOnlyWorker(Generic[_Item]):
    """A thread that works on the newest items and never falls behind."""

    def __init__(
        self,
        work: Callable[[_Item], None],
        name: str,
        waiting: int = 1,
        on_error: Callable[[FisheyeError], None] | None = None,
    ):
        """Start.

        Parameters
        ----------
        work
            Called with each item, in the thread.
        name
            Of the thread.
        waiting
            At most so many items wait while one is in work.
        on_error
            Called with the `FisheyeError` of an item, a bug as a `BugError`, after which the
            worker goes on; None: an error ends the worker.
        """
        self._work, self._on_error = work, on_error
        self._queue: LatestOnlyQueue[_Item] = LatestOnlyQueue(waiting)
        self._thread = Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    @property
    def dropped(self) -> int:
        """Items that newer ones replaced before their turn."""
        return self._queue.dropped

    def put(self, item: _Item) -> None:
        """Queue an item, in place of the oldest where too many wait."""
        self._queue.put(item)

    def stop(self) -> None:
        """Finish what is in work, and no more."""
        self._queue.close()
        self._thread.join()

    def _run(self) -> None:
        while (item := self._queue.get()) is not None:
            try:
                self._work(item)
            except BaseException as error:
                if self._on_error is None:
                    raise
                self._on_error(error if isinstance(error, FisheyeError) else bug_of(error))
