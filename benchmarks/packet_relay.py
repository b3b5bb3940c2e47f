"""The air between the two ends of a slow link: holds packets back, and loses some in bursts.

`packet_relay.py TAP TAP DELAY_S LOSS` carries packets between two TAP devices, given as file
descriptors; the lines `cut` and `mend` on stdin cut the link, and the end of stdin ends it.
"""

import os
import random
import sys
import time
from collections import deque
from select import select

_FRAME_BYTES = 65_536
_BURST_PACKETS = 4.0
"""Mean length of a burst of losses."""


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
        source: (target, Losses(loss, seed), deque())
        for seed, (source, target) in enumerate((taps, taps[::-1]))
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


if __name__ == '__main__':
    first, second, delay, share = sys.argv[1:]
    relay((int(first), int(second)), float(delay), float(share))
