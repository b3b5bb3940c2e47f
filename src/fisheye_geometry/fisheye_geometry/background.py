"""Slow work off the frame path."""

import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any

from fisheye_geometry.errors import FisheyeError


class Background:
    """One thread that does slow jobs in order, while frames go on with what there is."""

    def __init__(self, on_error: Callable[[FisheyeError], None]):
        """Start idle; `on_error` gets a job's `FisheyeError`, `threading.excepthook` a bug."""
        self._on_error = on_error
        self._thread = ThreadPoolExecutor(1)

    def do(self, job: Callable[..., Any], *arguments: Any) -> Future:
        """Queue a job; its result, or its `FisheyeError`, is in the future."""
        future = self._thread.submit(job, *arguments)
        future.add_done_callback(self._report)
        return future

    def stop(self) -> None:
        """Forget queued jobs and wait for the one that runs."""
        self._thread.shutdown(cancel_futures=True)

    def _report(self, future: Future) -> None:
        error = None if future.cancelled() else future.exception()
        if isinstance(error, FisheyeError):
            self._on_error(error)
        elif error:
            # A bug: in a future that nobody reads it would pass unnoticed.
            thread = threading.current_thread()
            details = type(error), error, error.__traceback__, thread
            threading.excepthook(threading.ExceptHookArgs(details))
