"""Waiting for other threads in a coroutine, so that the executor goes on with its callbacks."""

import concurrent.futures

from rclpy.task import Future


def awaitable(future: concurrent.futures.Future) -> Future:
    """Give a future of a thread as one that a callback of rclpy can await."""
    waiting = Future()

    def finish(done: concurrent.futures.Future) -> None:
        if error := done.exception():
            waiting.set_exception(error)
        else:
            waiting.set_result(done.result())

    future.add_done_callback(finish)
    return waiting
