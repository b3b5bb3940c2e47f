"""The token that shows who may look and press buttons: where it is kept and how it is told."""

import os
import re
import secrets
import stat
from functools import cache
from pathlib import Path

from fisheye_core.errors import FileAccessError, FileContentError

_ACTION = 'used as token_file'
_LONGEST = 200
_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL
_TOKEN = re.compile(r'[\w-]{8,100}', re.ASCII)


@cache
def new_token() -> str:
    """Return a token that nobody can guess, one for the life of the process.

    Pages that are open know it, and come again when the node has connected anew.
    """
    return secrets.token_urlsafe(12)


def kept_token(path: Path) -> str:
    """Return the token in a file; it is made, readable for its owner only, where there is none.

    Raises
    ------
    FileAccessError
        If the file cannot be read or written, or others can read it.
    FileContentError
        If it holds no token.
    """
    try:
        try:
            token = new_token()
            with os.fdopen(os.open(path, _NEW, 0o600), 'w') as file:
                file.write(f'{token}\n')
            return token
        except FileExistsError:
            return _read(path)
    except OSError as error:
        raise FileAccessError(path, _ACTION, error.strerror) from error


def _read(path: Path) -> str:
    # Without O_NONBLOCK a named pipe would be waited for.
    with os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), 'rb') as file:
        mode = os.fstat(file.fileno()).st_mode
        if not stat.S_ISREG(mode):
            raise FileAccessError(path, _ACTION, 'it is not a regular file')
        if mode & 0o077:
            reason = f'others can read it, its mode is {mode & 0o777:o}; expected 600'
            raise FileAccessError(path, _ACTION, reason)
        token = file.read(_LONGEST).decode(errors='replace').strip()
    if not _TOKEN.fullmatch(token):
        raise FileContentError(
            'it holds no token; expected 8 to 100 letters, digits, - and _', path
        )
    return token


def print_on_terminal(sentence: str) -> bool:
    """Print where a person sits, past every log; return whether there is such a place."""
    try:
        with Path('/dev/tty').open('w') as terminal:
            terminal.write(f'{sentence}\n')
    except OSError:
        return False
    return True
