"""Pictures in shared memory: never overwritten while somebody looks at them."""

import os
import socket

import numpy as np
import pytest

from fisheye_capture.shared_frames import SlotPool, Slots, receive, send


@pytest.fixture
def exchange():
    """Write a level of grey into a slot at one end; give the array at the other."""
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    slots, pool = Slots(), SlotPool()

    def pass_on(level, size=12):
        number = pool.take()
        target, files = slots.fit(number, size)
        target[:] = level
        send(theirs, {'slot': number}, files)
        for file in files:
            os.close(file)
        message, files = receive(ours)
        return number, pool.array(message['slot'], size, files)

    yield pass_on
    ours.close()
    theirs.close()


def test_a_picture_that_is_held_stays_as_it_is(exchange):
    numbers, pictures = zip(*(exchange(level) for level in range(5)), strict=True)
    assert [int(picture[0]) for picture in pictures] == [0, 1, 2, 3, 4]
    assert len(set(numbers)) == 5
    assert not pictures[0].flags.writeable


def test_memory_is_used_again_when_no_view_of_it_is_left(exchange):
    number, picture = exchange(1)
    view = picture.reshape(3, 4)[1:]
    del picture
    assert exchange(2)[0] != number
    np.testing.assert_array_equal(view, 1)
    del view
    assert number in {exchange(3)[0] for _ in range(3)}


def test_a_larger_picture_gets_more_memory(exchange):
    exchange(1, 12)
    assert exchange(2, 10_000)[1].sum() == 20_000


def test_the_last_words_of_who_left_are_read():
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    send(ours, {'slot': 0})
    send(theirs, {'lost': 'gone'})
    theirs.close()
    assert receive(ours) == ({'lost': 'gone'}, [])
    assert receive(ours) == ({}, [])
    ours.close()
