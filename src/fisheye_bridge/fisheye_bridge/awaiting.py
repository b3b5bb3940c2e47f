"""Waiting for other threads in a coroutine, so that the executor goes on with its callbacks."""

import concurrent.futures
import threading

from rclpy.task import Future

from fisheye_core.errors import FisheyeError


def awaitable(future: concurrent.futures.Future, *, within_s: float | None = None) -> Future:
    """Wrap a future of a thread as one that a callback of rclpy can await.

    Where the thread ended before it began the work, or the work takes longer than `within_s`, the
    callback gets a `FisheyeError`.
    """
    waiting = Future()

    def finish(done: concurrent.futures.Future) -> None:
        if waiting.done():
            return
        if done.cancelled():
            waiting.set_exception(FisheyeError('it was not done: the node ends'))
        elif error := done.exception():
            waiting.set_exception(error)
        else:
            waiting.set_result(done.result())

    def give_up() -> None:
        if not waiting.done():
            waiting.set_exception(
                FisheyeError(
                    f'it is not done after {within_s:g} s on this busy machine; it goes on'
                )
            )

    if within_s is not None:
        timer = threading.Timer(within_s, give_up)
        timer.daemon = True
        timer.start()
        future.add_done_callback(lambda _: timer.cancel())
    future.add_done_callback(finish)
    return waiting
