"""Work is shared, whole and safe."""

from functools import partial
from threading import Barrier, get_ident

import cv2
import pytest

from fisheye_core.parallel import run_parallel

TIMEOUT_S = 10.0


@pytest.fixture(params=[1, 2])
def threads(request, monkeypatch):
    monkeypatch.setattr(cv2, 'getNumThreads', lambda: request.param)
    return request.param


def test_every_job_is_done_once(threads):
    done = []
    run_parallel([partial(done.append, i) for i in range(100)])
    assert sorted(done) == list(range(100))


def test_jobs_run_at_once_in_as_many_threads_as_opencv_may_use(threads):
    together, seen = Barrier(threads), set()

    def job():
        together.wait(TIMEOUT_S)
        seen.add(get_ident())

    run_parallel([job] * threads)
    assert len(seen) == threads


def test_what_a_job_raises_is_raised_and_nothing_runs_on(threads):
    done = []

    def fail():
        raise ValueError('no')

    with pytest.raises(ValueError, match='no'):
        run_parallel([fail, *[partial(done.append, i) for i in range(10)]])
    finished = len(done)
    run_parallel([])
    assert len(done) == finished
