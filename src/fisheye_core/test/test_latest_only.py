"""Handing over: the newest is worked on, what waits too long is dropped and counted."""

from threading import Event

from fisheye_core.latest_only import LatestOnlyWorker


def test_only_the_newest_waits(wait_until):
    busy, start_pending_job, done = Event(), Event(), []

    def work(thing):
        busy.set()
        start_pending_job.wait()
        done.append(thing)

    newest = LatestOnlyWorker(work, 'test')
    newest.put(1)
    busy.wait()
    for thing in (2, 3, 4):
        newest.put(thing)
    start_pending_job.set()
    wait_until(lambda: len(done) == 2, 'the work')
    newest.stop()
    assert done == [1, 4]
    assert newest.dropped == 2


def test_it_stops_with_something_waiting():
    newest = LatestOnlyWorker(lambda thing: None, 'test')
    newest.stop()
    newest.put(1)
