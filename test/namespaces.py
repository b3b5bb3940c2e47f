"""Linux namespaces in which processes are run: another /dev/shm, another network."""

import subprocess
from contextlib import suppress

import pytest


class Namespace:
    """Namespaces of their own for some processes; they end with it.

    Attributes
    ----------
    pid : int
        Of the process that holds them open.
    prefix : tuple of str
        To go before a command that is to run there.
    """

    def __init__(self, kinds: tuple[str, ...], prepare: str):
        """Make namespaces of these kinds ('mount', 'net'); `prepare` is run there by a shell."""
        flags = [f'--{kind}' for kind in kinds]
        self._holder = subprocess.Popen(
            ['unshare', *flags, 'sh', '-c', f'{prepare} && echo ready && exec sleep infinity'],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        if self._holder.stdout.readline() != 'ready\n':
            reason = self._holder.communicate()[1].strip()
            pytest.skip(f'namespaces ({", ".join(kinds)}) are not permitted here: {reason}')
        self.pid = self._holder.pid
        self.prefix = ('nsenter', '--target', str(self.pid), *flags, '--')

    def __enter__(self) -> 'Namespace':
        return self

    def __exit__(self, *_) -> None:
        self._holder.kill()
        self._holder.communicate()


class Link:
    """A cable between two machines, each with a network and shared memory of its own.

    Attributes
    ----------
    robot, base : Namespace
        The two machines.
    """

    _DEVICE = 'link0'

    def __init__(self):
        kinds = 'mount', 'net'
        prepare = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up'
        self.robot, self.base = Namespace(kinds, prepare), Namespace(kinds, prepare)
        ends = [('name', self._DEVICE, 'netns', str(end.pid)) for end in (self.robot, self.base)]
        self._ip('link', 'add', *ends[0], 'type', 'veth', 'peer', *ends[1])
        for number, end in enumerate((self.robot, self.base), 1):
            address = f'10.77.0.{number}/24'
            self._ip('address', 'add', address, 'dev', self._DEVICE, prefix=end.prefix)
            self._ip('link', 'set', self._DEVICE, 'up', prefix=end.prefix)

    def __enter__(self) -> 'Link':
        return self

    def __exit__(self, *_) -> None:
        with suppress(subprocess.CalledProcessError):
            self._ip('link', 'delete', self._DEVICE, prefix=self.robot.prefix)
        self.robot.__exit__()
        self.base.__exit__()

    def cut(self) -> None:
        """Pull the cable."""
        self._ip('link', 'set', self._DEVICE, 'down', prefix=self.robot.prefix)

    def mend(self) -> None:
        """Plug it in again."""
        self._ip('link', 'set', self._DEVICE, 'up', prefix=self.robot.prefix)

    def _ip(self, *words, prefix=()) -> None:
        subprocess.run([*prefix, 'ip', *words], check=True)
