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
        return self._thread.submit(self._run, job, *arguments)

    def stop(self) -> None:
        """Forget queued jobs and wait for the one that runs."""
        self._thread.shutdown(cancel_futures=True)

    def _run(self, job: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return job(*arguments)
        except FisheyeError as error:
            self._on_error(error)
            raise
        except BaseException as error:
            bug = bug_of(error)
            self._on_error(bug)
            raise bug from error


def bug_of(error: BaseException) -> BugError:
    """Return a sentence about what no code expected: only this job is left undone."""
    place = extract_tb(error.__traceback__)[-1]
    return BugError(
        f'a bug, {type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno}, '
        f'{place.name}); please report it'
    )
