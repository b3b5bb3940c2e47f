"""Datagrams of a stream, handed on to all who look; some are lost where that is wanted."""

import random
import socket
from collections.abc import Callable
from contextlib import suppress
from threading import Lock, Thread

HOST = '127.0.0.1'


class Relay:
    """Hands on the datagrams that come to a port, less those that are to be lost."""

    def __init__(self, loss: float):
        self._loss = loss
        self._random = random.Random(3)
        self._targets: list[Callable[[int, bytes], object]] = []
        self._lock = Lock()
        self.has_new = False
        while True:
            first, second = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in 'ab')
            first.bind((HOST, 0))
            self.port = first.getsockname()[1]
            try:
                second.bind((HOST, self.port + 1))
                break
            except OSError:
                first.close()
        for channel, source in enumerate((first, second)):
            source.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_000_000)
            Thread(target=self._run, args=(channel, source), daemon=True).start()

    def add(self, send) -> None:
        """Call `send` with the channel, 0 or 1, and each datagram from now on."""
        with self._lock:
            self._targets.append(send)
            self.has_new = True

    def remove(self, send) -> None:
        """Call it no more."""
        with self._lock, suppress(ValueError):
            self._targets.remove(send)

    def _run(self, channel, source):
        while True:
            datagram = source.recv(65536)
            if channel == 0 and self._random.random() < self._loss:
                continue
            with self._lock:
                targets = list(self._targets)
            for send in targets:
                try:
                    send(channel, datagram)
                except OSError:
                    self.remove(send)
