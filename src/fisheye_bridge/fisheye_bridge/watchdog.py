"""Ending a process that hangs: a frozen picture would look alive."""

import faulthandler
from time import monotonic

HANGS_S = 30.0
"""No start and no callback takes as long, even on a slow and busy machine."""
_REARM_S = 1.0


class Watchdog:
    """Ends the process, and prints where each thread stands, unless it is fed within `HANGS_S`.

    What hangs in the middleware may hold the interpreter's lock: no other Python thread runs
    then, and no signal is handled. The timer of faulthandler needs no lock.
    """

    def __init__(self):
        self._due_s = 0.0

    def feed(self) -> None:
        """Report that the process is alive."""
        now_s = monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + _REARM_S
            faulthandler.dump_traceback_later(HANGS_S, exit=True)

    def stop(self) -> None:
        """Let the process live, whatever it does."""
        faulthandler.cancel_dump_traceback_later()
