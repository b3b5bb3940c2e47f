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

    def __init__(self, *, is_plugged: bool = True):
        kinds = 'mount', 'net'
        prepare = 'mount -t tmpfs tmpfs /dev/shm && ip link set lo up'
        self.robot, self.base = Namespace(kinds, prepare), Namespace(kinds, prepare)
        self._device, self._network = 'link77', 77
        self._lay()
        if is_plugged:
            self.mend()

    def __enter__(self) -> 'Link':
        return self

    def __exit__(self, *_) -> None:
        with suppress(subprocess.CalledProcessError):
            self._ip('link', 'delete', self._device, prefix=self.robot.prefix)
        self.robot.__exit__()
        self.base.__exit__()

    def cut(self) -> None:
        """Pull the cable."""
        self._ip('link', 'set', self._device, 'down', prefix=self.robot.prefix)

    def mend(self) -> None:
        """Plug it in, again or for the first time."""
        self._ip('link', 'set', self._device, 'up', prefix=self.robot.prefix)

    def readdress(self, end: Namespace) -> None:
        """Change the address of one of the machines."""
        former, self._hosts[end] = self._address(end), self._hosts[end] + 10
        self._ip('address', 'delete', former, 'dev', self._device, prefix=end.prefix)
        self._ip('address', 'add', self._address(end), 'dev', self._device, prefix=end.prefix)

    def replace(self) -> None:
        """Replace the cable by one in another network, as from Wi-Fi to LTE."""
        self._ip('link', 'delete', self._device, prefix=self.robot.prefix)
        self._network += 1
        self._device = f'link{self._network}'
        self._lay()
        self.mend()

    def _lay(self) -> None:
        """Lay a cable that is plugged in at the base only."""
        self._hosts = {self.robot: 1, self.base: 2}
        ends = [('name', self._device, 'netns', str(end.pid)) for end in self._hosts]
        self._ip('link', 'add', *ends[0], 'type', 'veth', 'peer', *ends[1])
        for end in self._hosts:
            self._ip('address', 'add', self._address(end), 'dev', self._device, prefix=end.prefix)
        self._ip('link', 'set', self._device, 'up', prefix=self.base.prefix)

    def _address(self, end: Namespace) -> str:
        return f'10.{self._network}.0.{self._hosts[end]}/24'

    def _ip(self, *words, prefix=()) -> None:
        subprocess.run([*prefix, 'ip', *words], check=True)
