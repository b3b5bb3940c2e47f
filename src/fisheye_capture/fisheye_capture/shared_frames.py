"""Memory that two processes share, so that the pixels of a picture are not copied between them."""

import json
import mmap
import os
import socket
import weakref
from collections import deque
from typing import Any

import numpy as np

_MAX_MESSAGE = 65536


def send(channel: socket.socket, message: dict[str, Any], files: tuple[int, ...] = ()) -> None:
    """Send a message, and open files with it."""
    socket.send_fds(channel, [json.dumps(message).encode()], list(files))


def receive(channel: socket.socket) -> tuple[dict[str, Any], list[int]]:
    """Wait for a message and its files; empty when the other end is gone."""
    try:
        data, files, _, _ = socket.recv_fds(channel, _MAX_MESSAGE, 1)
    except ConnectionResetError:
        # The other end left without reading what it was sent; its own last words are still there.
        data, files, _, _ = socket.recv_fds(channel, _MAX_MESSAGE, 1)
    return (json.loads(data) if data else {}), files


class Slots:
    """The writing side: slots of memory by number, each as large as what is put there."""

    def __init__(self):
        self._slots: dict[int, mmap.mmap] = {}

    def fit(self, number: int, size: int) -> tuple[np.ndarray, tuple[int, ...]]:
        """Return a slot's memory (size,) uint8 and, if it is new, the file to send along."""
        memory = self._slots.get(number)
        files: tuple[int, ...] = ()
        if memory is None or len(memory) < size:
            file = os.memfd_create('picture')
            os.ftruncate(file, size)
            memory = self._slots[number] = mmap.mmap(file, size)
            files = (file,)
        return np.frombuffer(memory, np.uint8, size), files


class SlotPool:
    """The reading side: hands out slots, and knows when nobody uses a picture in one any more."""

    def __init__(self):
        self._slots: dict[int, mmap.mmap] = {}
        self._free: deque[int] = deque()
        self._count = 0

    def take(self) -> int:
        """Return the number of a slot that is free."""
        if self._free:
            return self._free.popleft()
        self._count += 1
        return self._count - 1

    def array(self, number: int, size: int, files: list[int]) -> np.ndarray:
        """Return what is in a slot, (size,) uint8; the slot is free when the array is gone."""
        for file in files:
            self._slots[number] = mmap.mmap(file, 0, access=mmap.ACCESS_READ)
            os.close(file)
        array = np.frombuffer(self._slots[number], np.uint8, size)
        weakref.finalize(array, self._free.append, number).atexit = False
        return array
