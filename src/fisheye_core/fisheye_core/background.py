"""Slow work off the frame path."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from traceback import extract_tb
from typing import Any

from fisheye_core.errors import BugError, FisheyeError


class Background:
    """One thread that does slow jobs in order, while frames go on with what there is."""

    def __init__(self, on_error: Callable[[FisheyeError], None]):
        """Start idle; `on_error` gets a job's `FisheyeError`, and a bug as a `BugError`."""
        self._on_error = on_error
        self._thread = ThreadPoolExecutor(1)

    def do(self, job: Callable[..., Any], *arguments: Any) -> Future:
        """Queue a job; its result, or its `FisheyeError`, is in the future."""
        result: Future = Future()
        self._thread.submit(job, *arguments).add_done_callback(
            lambda done: self._hand_on(done, result)
        )
        return result

    def stop(self) -> None:
        """Forget queued jobs and wait for the one that runs."""
        self._thread.shutdown(cancel_futures=True)

    def _hand_on(self, done: Future, result: Future) -> None:
        if done.cancelled():
            result.cancel()
            result.set_running_or_notify_cancel()
            return
        error = done.exception()
        if error is None:
            result.set_result(done.result())
            return
        if not isinstance(error, FisheyeError):
            error = _bug(error)
        self._on_error(error)
        result.set_exception(error)


def _bug(error: BaseException) -> BugError:
    """Return a sentence about what no code expected: only this job is left undone."""
    place = extract_tb(error.__traceback__)[-1]
    bug = BugError(
        f'a bug, {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno}, '
        f'{place.name}); please report it'
    )
    bug.__cause__ = error
    return bug
