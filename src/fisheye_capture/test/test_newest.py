"""Handing over: the newest is worked on, what waits too long is dropped and counted."""

from threading import Event

from fisheye_capture.newest import Newest


def test_only_the_newest_waits(wait_until):
    busy, go_on, done = Event(), Event(), []

    def work(thing):
        busy.set()
        go_on.wait()
        done.append(thing)

    newest = Newest(work, 'test')
    newest.put(1)
    busy.wait()
    for thing in (2, 3, 4):
        newest.put(thing)
    go_on.set()
    wait_until(lambda: len(done) == 2, 'the work')
    newest.stop()
    assert done == [1, 4]
    assert newest.dropped == 2


def test_it_stops_with_something_waiting():
    newest = Newest(lambda thing: None, 'test')
    newest.stop()
    newest.put(1)
