"""Work shared between threads: for jobs that leave Python's lock to others, as OpenCV's do."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache

import cv2


def run_parallel(jobs: Sequence[Callable[[], None]]) -> None:
    """Run jobs on as many threads as OpenCV may use, this one among them; return when all ended.

    What a job raises is raised here.
    """
    left = iter(jobs)
    helpers = [_pool().submit(_work, left) for _ in range(min(cv2.getNumThreads(), len(jobs)) - 1)]
    try:
        _work(left)
    finally:
        # A helper that could not start by now has nothing left to do.
        ended = [helper.cancel() or helper.exception() for helper in helpers]
    for error in ended:
        if isinstance(error, BaseException):
            raise error


def _work(left: Iterator[Callable[[], None]]) -> None:
    for job in left:
        job()


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(max(1, cv2.getNumberOfCPUs() - 1), 'run_parallel')
