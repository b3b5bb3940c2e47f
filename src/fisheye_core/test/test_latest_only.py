"""Handing over: the newest is worked on, what waits too long is dropped and counted."""

from threading import Event

from fisheye_core.latest_only import LatestOnlyQueue, LatestOnlyWorker
from fisheye_testing.waiting import wait_for

DEADLINE_S = 20.0


def test_only_the_newest_waits():
    busy, resume, done = Event(), Event(), []

    def work(thing):
        busy.set()
        resume.wait()
        done.append(thing)

    worker = LatestOnlyWorker(work, 'test')
    worker.put(1)
    busy.wait()
    for thing in (2, 3, 4):
        worker.put(thing)
    resume.set()
    wait_for(lambda: len(done) == 2, DEADLINE_S, 'the work')
    worker.stop()
    assert done == [1, 4]
    assert worker.dropped == 2


def test_it_stops_with_something_waiting():
    worker = LatestOnlyWorker(lambda thing: None, 'test')
    worker.stop()
    worker.put(1)


def test_a_closed_queue_gives_nothing_more():
    queue = LatestOnlyQueue(2)
    for item in (1, 2, 3):
        queue.put(item)
    assert queue.get() == 2
    queue.clear()
    queue.put(4)
    assert queue.get() == 4
    queue.put(5)
    queue.close()
    assert queue.get() is None
    assert queue.dropped == 1, 'what is cleared is not counted'
