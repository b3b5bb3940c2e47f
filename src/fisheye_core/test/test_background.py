"""Slow work off the frame path: what goes wrong there is heard of."""

import threading

import pytest

from fisheye_core.background import Background
from fisheye_core.errors import BugError, FisheyeError, OverlapError
from fisheye_testing.waiting import wait_for


@pytest.fixture
def background():
    told = []
    background = Background(told.append)
    background.told = told
    yield background
    background.stop()


def fail(error):
    raise error


def test_a_sentence_is_told(background):
    future = background.do(fail, OverlapError('no'))
    with pytest.raises(FisheyeError):
        future.result()
    background.stop()
    assert [str(error) for error in background.told] == ['no']


def test_a_bug_is_told_with_its_place_and_leaves_the_thread_alive(background):
    future = background.do(fail, ZeroDivisionError('oh'))
    with pytest.raises(
        BugError, match=r'a bug, ZeroDivisionError: oh \(test_background.py:\d+, fail'
    ):
        future.result()
    assert background.do(int, '7').result() == 7
    assert [type(error) for error in background.told] == [BugError]


def test_what_was_not_begun_is_cancelled(background):
    begun, may_end = threading.Event(), threading.Event()

    def slow():
        begun.set()
        may_end.wait()

    first, second = background.do(slow), background.do(int)
    begun.wait()
    stopping = threading.Thread(target=background.stop)
    stopping.start()
    wait_for(second.cancelled, what='the end of what was not begun')
    may_end.set()
    stopping.join()
    assert first.result() is None
