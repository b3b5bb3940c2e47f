"""A slow link between two machines: limited in rate, with a delay and with losses in bursts.

Each end is a network namespace with a TAP device, whose queue `tc tbf` empties at the link's rate;
`packet_relay`, which reads the two devices, holds each packet back for the delay, or loses it.
"""

import fcntl
import os
import struct
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from namespaces import Namespace

ROBOT, BASE = '10.88.0.1', '10.88.0.2'
_SET_TAP, _TAP, _NO_HEADER = 0x400454CA, 0x0002, 0x1000
"""ioctl of tun(4) and its flags."""
_RELAY = str(Path(__file__).with_name('packet_relay.py'))
_QUEUE_S = 0.25
"""Of the link's rate that its queue holds, as that of a modem does."""


class LinkQuality(NamedTuple):
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

    def __init__(self, quality: LinkQuality):
        prepare = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up'
        self.robot, self.base = (Namespace(('mount', 'net'), prepare) for _ in range(2))
        rate, taps = f'{quality.mbit_s}mbit', []
        ends = (self.robot, self.base), (self.base, self.robot)
        ip = {self.robot: ROBOT, self.base: BASE}
        mac = {self.robot: '02:00:00:00:00:01', self.base: '02:00:00:00:00:02'}
        queue = max(30_000, round(quality.mbit_s * 1e6 / 8 * _QUEUE_S))
        for device, (end, other) in zip(('robot', 'base'), ends, strict=True):
            device += str(os.getpid())
            taps.append(_tap(device))
            _run('ip', 'link', 'set', device, 'netns', str(end.pid))
            _run(*end.prefix, 'ip', 'link', 'set', device, 'address', mac[end], 'up')
            _run(*end.prefix, 'ip', 'address', 'add', f'{ip[end]}/24', 'dev', device)
            # Known from the beginning: who asks for it thrice in vain says that there is no route.
            known = ('lladdr', mac[other], 'dev', device)
            _run(*end.prefix, 'ip', 'neighbour', 'add', ip[other], *known)
            shape = ('root', 'tbf', 'rate', rate, 'burst', '4kb', 'limit', str(queue))
            _run(*end.prefix, 'tc', 'qdisc', 'add', 'dev', device, *shape)
        arguments = *taps, quality.delay_ms / 1e3, quality.loss
        self._relay = subprocess.Popen(
            [sys.executable, _RELAY, *map(str, arguments)],
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


def _tap(name: str) -> int:
    device = os.open('/dev/net/tun', os.O_RDWR)
    fcntl.ioctl(device, _SET_TAP, struct.pack('16sH', name.encode(), _TAP | _NO_HEADER))
    return device


def _run(*words: str) -> None:
    subprocess.run(words, check=True)
