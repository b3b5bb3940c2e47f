"""ROS domains for tests: each alone in its own, and without what killed processes left there."""

import fcntl
import random
import tempfile
from collections import deque
from contextlib import suppress
from pathlib import Path
from typing import IO

_SHARED_MEMORY = Path('/dev/shm')
_FIRST_PORT, _PORTS = 7400, 250
"""Of domain 0, and of each domain (OMG RTPS 2.2, section 9.6.1)."""
_domain_locks: deque[IO[str]] = deque()
"""Open files whose locks keep the last domains picked here."""
_MOST_DOMAINS = 20
"""Domains picked before these are free for others again."""


def unused_domain() -> int:
    """Pick a ROS domain that no other test on this machine uses."""
    domain, lock = locked_domain()
    _domain_locks.append(lock)
    while len(_domain_locks) > _MOST_DOMAINS:
        _domain_locks.popleft().close()
    return domain


def locked_domain() -> tuple[int, IO[str]]:
    """Pick such a domain, and return it with the open file that keeps it."""
    for domain in random.sample(range(1, 101), 100):
        lock = Path(tempfile.gettempdir(), f'fisheye-domain-{domain}.lock').open('w')  # noqa: SIM115
        with suppress(BlockingIOError):
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _clear(domain)
            return domain, lock
        lock.close()
    raise RuntimeError('every ROS domain from 1 to 100 is in use by a test')


def ports(domain: int) -> set[Path]:
    """Return the files through which Fast DDS hands data to the nodes of a domain."""
    first = _FIRST_PORT + _PORTS * domain
    files = (_SHARED_MEMORY / f'fastrtps_port{first + number}' for number in range(_PORTS))
    return {file for file in files if file.exists()}


def _clear(domain: int) -> None:
    """Remove the ports of Fast DDS in shared memory that nobody listens at any more.

    A node that opens one of them may find it broken, and is deaf.
    """
    for port in ports(domain):
        locks = (port.with_name(port.name + kind) for kind in ('_el', '_sl'))
        if not any(map(_is_locked, locks)):
            port.unlink(missing_ok=True)


def _is_locked(path: Path) -> bool:
    try:
        with path.open() as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except FileNotFoundError:
        return False
    except BlockingIOError:
        return True
    return False
