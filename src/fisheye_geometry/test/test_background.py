"""Slow work off the frame path: what goes wrong there is heard of."""

import threading

import pytest

from fisheye_geometry.background import Background
from fisheye_geometry.errors import FisheyeError, OverlapError


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


def test_a_bug_is_not_swallowed(background, monkeypatch):
    bugs = []
    monkeypatch.setattr(threading, 'excepthook', lambda details: bugs.append(details.exc_type))
    background.do(fail, ZeroDivisionError())
    background.stop()
    assert (bugs, background.told) == ([ZeroDivisionError], [])
