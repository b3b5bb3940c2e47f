"""Waiting for other threads in a coroutine, so that the executor goes on with its callbacks."""

import concurrent.futures

from rclpy.task import Future

from fisheye_core.errors import FisheyeError


def awaitable(future: concurrent.futures.Future) -> Future:
    """Give a future of a thread as one that a callback of rclpy can await.

    Where the thread ended before it began the work, the callback gets a `FisheyeError`.
    """
    waiting = Future()

    def finish(done: concurrent.futures.Future) -> None:
        if done.cancelled():
            waiting.set_exception(FisheyeError('it was not done: the node ends'))
        elif error := done.exception():
            waiting.set_exception(error)
        else:
            waiting.set_result(done.result())

    future.add_done_callback(finish)
    return waiting
