"""Commands of the shell: what they refuse is one sentence, and an exit code."""

import argparse
import os
import shutil
import sys
from collections.abc import Callable
from typing import NoReturn

from fisheye_core.errors import FisheyeError, SettingError

FAILED = 1
_INTERRUPTED, _NO_READER = 130, 141
"""As shells count what signals end: 128 and the number of SIGINT and SIGPIPE."""


class CommandParser(argparse.ArgumentParser):
    """Raises a `SettingError` where argparse would print its usage and end the process."""

    def error(self, message: str) -> NoReturn:
        """Refuse the words of a command line."""
        raise SettingError(f'{message} (see {self.prog} --help)')


def exit_code(name: str, command: Callable[[], int]) -> int:
    """Run a command; return its own exit code, or that of what ended it.

    Parameters
    ----------
    name
        Stands in front of what is refused.
    command
        Raises a `FisheyeError` where it cannot go on.
    """
    try:
        code = command()
        sys.stdout.flush()
        return code
    except FisheyeError as error:
        print(f'{name}: {error}', file=sys.stderr)
        return FAILED
    except KeyboardInterrupt:
        return _INTERRUPTED
    except BrokenPipeError:
        # Python would write the rest when it ends, and say that it cannot.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return _NO_READER


def show_progress(line: str, width: int) -> None:
    """Show how far a command has come, on the same line as before.

    Parameters
    ----------
    line
        What to show.
    width
        Characters to which it is cut or filled; fewer where the terminal has fewer, on which it
        would go on in a new line each time.
    """
    width = min(width, shutil.get_terminal_size().columns - 1)
    print(f'\r{line:{width}.{width}}', end='', file=sys.stderr, flush=True)
