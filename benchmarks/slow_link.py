"""A slow link between two machines: limited in rate, with a delay and with losses in bursts.

Each end is a network namespace with a TAP device, whose queue `tc tbf` empties at the link's rate;
what reads the two devices holds each packet back for the delay, or loses it. Run as a program it
is the relay: `slow_link.py ROBOT_FD BASE_FD DELAY_S LOSS`, cut and mended by lines on stdin.
"""

import fcntl
import os
import random
import struct
import subprocess
import sys
import time
from collections import deque
from select import select
from typing import NamedTuple

from namespaces import Namespace

ROBOT, BASE = '10.88.0.1', '10.88.0.2'
_SET_TAP, _TAP, _NO_HEADER = 0x400454CA, 0x0002, 0x1000
"""ioctl of tun(4) and its flags."""
_FRAME_BYTES = 65_536
_QUEUE_S = 0.25
"""Of the link's rate that its queue holds, as that of a modem does."""
_BURST_PACKETS = 4.0
"""Mean length of a burst of losses."""


class Quality(NamedTuple):
    """What a link is like: its rate each way, its delay one way and how much it loses."""

    mbit_s: float
    delay_ms: float
    loss: float

    def __str__(self) -> str:
        return f'{self.mbit_s:g} Mbit/s, {self.delay_ms:g} ms, {self.loss:.0%} lost'


class SlowLink:
    """A slow link; as a context manager it ends.

    Attributes
    ----------
    robot, base : Namespace
        The two machines, at the addresses `ROBOT` and `BASE`.
    """

    def __init__(self, quality: Quality):
        prepare = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up'
        self.robot, self.base = (Namespace(('mount', 'net'), prepare) for _ in range(2))
        rate, taps = f'{quality.mbit_s}mbit', []
        queue = max(30_000, round(quality.mbit_s * 1e6 / 8 * _QUEUE_S))
        for name, end, address in (
            ('robot', self.robot, ROBOT),
            ('base', self.base, BASE),
        ):
            device = f'{name}{os.getpid()}'
            taps.append(_tap(device))
            _run('ip', 'link', 'set', device, 'netns', str(end.pid))
            _run(*end.prefix, 'ip', 'address', 'add', f'{address}/24', 'dev', device)
            _run(*end.prefix, 'ip', 'link', 'set', device, 'up')
            shape = ('root', 'tbf', 'rate', rate, 'burst', '4kb', 'limit', str(queue))
            _run(*end.prefix, 'tc', 'qdisc', 'add', 'dev', device, *shape)
        arguments = *taps, quality.delay_ms / 1e3, quality.loss
        self._relay = subprocess.Popen(
            [sys.executable, __file__, *map(str, arguments)],
            stdin=subprocess.PIPE,
            pass_fds=taps,
            text=True,
        )
        for tap in taps:
            os.close(tap)

    def __enter__(self) -> 'SlowLink':
        return self

    def __exit__(self, *_) -> None:
        self._relay.kill()
        self._relay.communicate()
        self.robot.__exit__()
        self.base.__exit__()

    def cut(self) -> None:
        """Lose everything from now on."""
        self._tell('cut')

    def mend(self) -> None:
        """Carry packets again."""
        self._tell('mend')

    def _tell(self, word: str) -> None:
        self._relay.stdin.write(f'{word}\n')
        self._relay.stdin.flush()


class Losses:
    """Which packets are lost: in bursts, as of a radio that fades (Gilbert, 1960).

    Bell System Technical Journal 39(5), doi:10.1002/j.1538-7305.1960.tb03959.x.
    """

    def __init__(self, share: float, seed: int):
        self._random, self._is_bad = random.Random(seed), False
        self._recover = 1 / _BURST_PACKETS
        self._fade = self._recover * share / (1 - share)

    def next(self) -> bool:
        """Return whether the next packet is lost."""
        change = self._recover if self._is_bad else self._fade
        self._is_bad ^= self._random.random() < change
        return self._is_bad


def relay(taps: tuple[int, int], delay_s: float, loss: float) -> None:
    """Carry packets both ways until stdin ends."""
    ways = {
        source: (target, Losses(loss, source), deque())
        for source, target in zip(taps, reversed(taps), strict=True)
    }
    is_cut = False
    while True:
        now_s = time.monotonic()
        due_s = [held[0][0] for _, _, held in ways.values() if held]
        wait_s = max(0.0, min(due_s) - now_s) if due_s else None
        ready, _, _ = select([*ways, sys.stdin], [], [], wait_s)
        now_s = time.monotonic()
        for source in ready:
            if source is sys.stdin:
                word = sys.stdin.readline().strip()
                if not word:
                    return
                is_cut = word == 'cut'
                continue
            packet = os.read(source, _FRAME_BYTES)
            _, losses, held = ways[source]
            if not (losses.next() or is_cut):
                held.append((now_s + delay_s, packet))
        for target, _, held in ways.values():
            while held and held[0][0] <= now_s:
                os.write(target, held.popleft()[1])


def _tap(name: str) -> int:
    device = os.open('/dev/net/tun', os.O_RDWR)
    fcntl.ioctl(device, _SET_TAP, struct.pack('16sH', name.encode(), _TAP | _NO_HEADER))
    return device


def _run(*words: str) -> None:
    subprocess.run(words, check=True)


if __name__ == '__main__':
    first, second, delay, share = sys.argv[1:]
    relay((int(first), int(second)), float(delay), float(share))
