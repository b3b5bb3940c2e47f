"""Decoding JPEGs without libjpeg's own lines in the log.

libjpeg writes straight to the process's standard error, whatever OpenCV is told: a webcam with two
stray bytes behind each picture filled the log with 15 lines a second.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Lock

_STDERR = 2
_LIBJPEG = (
    b'Corrupt JPEG data',
    b'Premature end of JPEG',
    b'Invalid SOS parameters',
    b'Unsupported marker',
    b'Unknown Adobe color transform',
    b'Inconsistent progression sequence',
    b'Warning: unknown JFIF revision',
)
"""How its lines begin (the warnings of jerror.h)."""


class _StderrFilter:
    """Holds standard error back while anybody decodes, and passes on what is not libjpeg's."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._decoding = 0
        self._is_over = False
        self._held = self._stderr = -1
        self._passed = 0

    def enter(self) -> None:
        with self._lock:
            if self._is_over:
                raise OSError('standard error is not held back any more')
            if not self._decoding:
                if self._held < 0:
                    self._held = os.memfd_create('stderr', os.MFD_CLOEXEC)
                    fcntl.fcntl(self._held, fcntl.F_SETFL, os.O_APPEND)
                self._stderr = os.dup(_STDERR)
                os.dup2(self._held, _STDERR)
            self._decoding += 1

    def stop(self) -> None:
        with self._lock:
            self._is_over = True
            if self._decoding:
                os.dup2(self._stderr, _STDERR)

    def leave(self) -> None:
        with self._lock:
            self._decoding -= 1
            if not self._decoding:
                os.dup2(self._stderr, _STDERR)
            self._pass_on()
            if not self._decoding:
                os.close(self._stderr)
                if self._passed:
                    os.ftruncate(self._held, 0)
                    self._passed = 0

    def _pass_on(self) -> None:
        size = os.fstat(self._held).st_size
        if size == self._passed:
            return
        lines = os.pread(self._held, size - self._passed, self._passed).splitlines(keepends=True)
        self._passed = size
        others = b''.join(line for line in lines if not line.startswith(_LIBJPEG))
        if others:
            os.write(self._stderr, others)


_stderr_filter = _StderrFilter()


def stop() -> None:
    """Hold nothing back from now on: what a process says at its end must not be lost."""
    _stderr_filter.stop()


@contextmanager
def without_libjpeg_lines() -> Iterator[None]:
    """Keep what libjpeg says from standard error; what others say meanwhile comes behind."""
    try:
        _stderr_filter.enter()
    except OSError:  # There is no standard error, no more files may be opened, or it is the end.
        yield
        return
    try:
        yield
    finally:
        with suppress(OSError):
            _stderr_filter.leave()
