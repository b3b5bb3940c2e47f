"""What a thread answers, or leaves undone, reaches the coroutine that waits for it."""

import concurrent.futures

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from fisheye_bridge.awaiting import awaitable
from fisheye_core.errors import FisheyeError, OverlapError


@pytest.fixture
def answer():
    """Give what a coroutine makes of a future that waits when the coroutine begins."""
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = SingleThreadedExecutor(context=context)

    def answer(future, end):
        async def wait():
            return await awaitable(future)

        task = executor.create_task(wait)
        executor.spin_once(timeout_sec=0)
        assert not task.done()
        end(future)
        executor.spin_until_future_complete(task, timeout_sec=10)
        assert task.done()
        return task.result()

    yield answer
    executor.shutdown()
    rclpy.shutdown(context=context)


def test_a_result_is_given(answer):
    assert answer(concurrent.futures.Future(), lambda future: future.set_result(7)) == 7


def test_an_error_is_raised(answer):
    with pytest.raises(OverlapError, match='nothing there'):
        answer(
            concurrent.futures.Future(),
            lambda future: future.set_exception(OverlapError('nothing there')),
        )


def test_what_was_left_undone_is_an_error_too(answer):
    def cancel(future):
        assert future.cancel()
        future.set_running_or_notify_cancel()

    with pytest.raises(FisheyeError, match='it was not done: the node ends'):
        answer(concurrent.futures.Future(), cancel)
