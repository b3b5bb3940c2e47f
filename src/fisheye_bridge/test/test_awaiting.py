"""What a thread answers, or leaves undone, reaches the coroutine that waits for it."""

import concurrent.futures
from time import monotonic

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor

from fisheye_bridge.awaiting import awaitable
from fisheye_core.errors import FisheyeError, OverlapError


@pytest.fixture
def answer():
    """Return what a coroutine makes of a future that waits when the coroutine begins."""
    context = rclpy.Context()
    rclpy.init(context=context)
    executor = SingleThreadedExecutor(context=context)

    def answer(future, end, **options):
        async def wait():
            return await awaitable(future, **options)

        task = executor.create_task(wait)
        executor.spin_once(timeout_sec=0)
        assert not task.done()
        end(future)
        deadline_s = monotonic() + 10.0
        while not task.done() and monotonic() < deadline_s:
            executor.spin_once(timeout_sec=0.05)
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


def test_what_takes_too_long_is_an_error_and_goes_on(answer):
    future = concurrent.futures.Future()
    with pytest.raises(FisheyeError, match=r'it is not done after 0\.05 s on this busy'):
        answer(future, lambda _: None, within_s=0.05)
    future.set_result(7)
    assert future.result() == 7


def test_what_is_done_in_time_is_given(answer):
    future = concurrent.futures.Future()
    assert answer(future, lambda future: future.set_result(7), within_s=60.0) == 7
