"""Linux namespaces in which processes are run: another /dev/shm, another network."""

import subprocess

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
