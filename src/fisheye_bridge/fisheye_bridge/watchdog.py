"""Ending a process that hangs: a frozen picture would look alive."""

import faulthandler
import os
from time import monotonic

HANGS_S, ENDS_S = 30.0, 10.0
"""No start and no callback takes as long as the one, even on a slow and busy machine; no node as
long as the other to end."""
_REARM_S = 1.0


class Watchdog:
    """Ends the process, and prints where each thread stands, unless it is fed in time.

    What hangs in the middleware may hold the interpreter's lock: no other Python thread runs
    then, and no signal is handled. The timer of faulthandler needs no lock.
    """

    def __init__(self):
        self._due_s = 0.0
        # While a JPEG is decoded, standard error leads elsewhere.
        try:
            self._stderr = os.dup(2)
        except OSError:  # there is none
            self._stderr = os.open(os.devnull, os.O_WRONLY)

    def feed(self) -> None:
        """Report that the process is alive, and will be again within `HANGS_S`."""
        now_s = monotonic()
        if now_s >= self._due_s:
            self._due_s = now_s + _REARM_S
            faulthandler.dump_traceback_later(HANGS_S, exit=True, file=self._stderr)

    def ending(self) -> None:
        """Report that a node begins to end: in Fast DDS that may hang, and never come back."""
        self._due_s = 0.0
        faulthandler.dump_traceback_later(ENDS_S, exit=True, file=self._stderr)

    def stop(self) -> None:
        """Let the process live, whatever it does."""
        faulthandler.cancel_dump_traceback_later()
        os.close(self._stderr)
