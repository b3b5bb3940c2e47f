"""Regular files: read whole up to a bound, and replaced as a whole."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fcntl import LOCK_EX, LOCK_NB, flock
from glob import escape
from pathlib import Path
from typing import BinaryIO, TextIO

_KINDS = (
    (stat.S_ISDIR, 'a folder'),
    (stat.S_ISFIFO, 'a FIFO'),
    (stat.S_ISSOCK, 'a socket'),
    (stat.S_ISCHR, 'a device'),
    (stat.S_ISBLK, 'a device'),
)


def is_missing(path: str | Path) -> bool:
    """Whether there is no such file; of one that cannot be looked at, reading it tells."""
    with suppress(OSError):
        try:
            Path(path).stat()
        except (FileNotFoundError, ValueError):  # no file has a zero byte in its name
            return True
    return False


class NotRegularError(OSError):
    """There is something else than a regular file."""


@contextmanager
def opened_regular(path: str | Path) -> Iterator[BinaryIO]:
    """Open a regular file, or what a link to one leads to, for reading; errors as of `open`.

    Raises
    ------
    NotRegularError
        If it is something else.
    """
    # Opening a FIFO would otherwise wait for somebody who writes.
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        _check_regular(os.fstat(descriptor).st_mode)
        with open(descriptor, 'rb', closefd=False) as file:
            yield file
    finally:
        os.close(descriptor)


def read_regular(path: str | Path, max_bytes: int) -> bytes:
    """Read a regular file, or what a link to one leads to.

    Parameters
    ----------
    path
        Of the file.
    max_bytes
        At most that much and one more is read: who gets more knows that there is more.

    Raises
    ------
    OSError
        If it cannot be read or is not a regular file; its `strerror` says why.
    """
    with opened_regular(path) as file:
        return file.read(max_bytes + 1)


def replace_regular(path: str | Path, text: str, *, mode: int = 0o644) -> None:
    """Write a file so that readers see the former content or the new one, never a part.

    A link stays, and what it leads to is replaced. What writers that were killed left behind is
    removed. Nobody but the owner can read it before it has its mode.

    Raises
    ------
    OSError
        If it cannot be written or there is something else than a regular file.
    """
    path = Path(os.path.realpath(path))
    with suppress(FileNotFoundError):
        _check_regular(path.stat().st_mode)
    path.parent.mkdir(parents=True, exist_ok=True)
    _clear_abandoned(path)
    file, temporary = _temporary_beside(path)
    try:
        with file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
            os.fchmod(file.fileno(), mode)
            Path(temporary).replace(path)
    except OSError:
        Path(temporary).unlink(missing_ok=True)
        raise


def check_replaceable(path: str | Path) -> None:
    """Refuse, before there is anything to write, what `replace_regular` cannot replace.

    Raises
    ------
    OSError
        As `replace_regular`.
    """
    path = Path(os.path.realpath(path))
    with suppress(FileNotFoundError):
        _check_regular(path.stat().st_mode)
    folder = next(folder for folder in path.parents if folder.exists())
    with tempfile.TemporaryFile(dir=folder):
        pass


def _temporary_beside(path: Path) -> tuple[TextIO, str]:
    """Open a new file that is locked as long as it is open: somebody writes it."""
    while True:
        descriptor, temporary = tempfile.mkstemp('.tmp', f'.{path.name}.', path.parent)
        file = os.fdopen(descriptor, 'w', encoding='utf-8')
        flock(file, LOCK_EX)
        if os.fstat(descriptor).st_nlink:
            return file, temporary
        file.close()  # another writer took it for abandoned before it was locked


def _clear_abandoned(path: Path) -> None:
    """Remove temporary files for which no writer holds a lock any more."""
    for temporary in path.parent.glob(f'.{escape(path.name)}.????????.tmp'):
        with suppress(OSError), temporary.open('r+b') as file:
            flock(file, LOCK_EX | LOCK_NB)
            temporary.unlink()


def _check_regular(mode: int) -> None:
    if not stat.S_ISREG(mode):
        kind = next((name for is_kind, name in _KINDS if is_kind(mode)), 'something else')
        raise NotRegularError(0, f'it is {kind}; expected a regular file')
