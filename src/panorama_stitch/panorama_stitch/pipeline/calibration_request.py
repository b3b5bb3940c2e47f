"""A measurement of the overlaps that somebody asked for and waits for."""

from collections.abc import Callable
from concurrent.futures import Future, wait
from time import monotonic

from panorama_stitch.pipeline.panorama_settings import PanoramaOutputSettings

_ROOM = 2.0
"""What a measurement that takes long gets, in units of what a panorama takes."""
_LONG_S = 2.0
"""Takes long: with a core of its own, a measurement ends earlier."""


class CalibrationRequest:
    """The latest measurement asked for: shared by all who ask for the same while it runs."""

    def __init__(self, measure: Callable[[PanoramaOutputSettings, str, bool], Future]):
        """Start idle; `measure` is `CompositorBuilder.calibrate`."""
        self._measure = measure
        self._what: tuple | None = None
        self._asked_s = 0.0
        self._answer: Future = Future()
        self._answer.cancel()

    def ask(self, settings: PanoramaOutputSettings, method: str, save: bool) -> Future:
        """Start a measurement, or return that of the same which is being made.

        On a slow machine, one who asks again does not wait behind what nobody waits for any more.
        """
        what = settings, method, save
        if what != self._what or self._answer.done():
            self._what, self._asked_s = what, monotonic()
            self._answer = self._measure(*what)
        return self._answer

    def leave_room(self, took_s: float) -> None:
        """Wait, so that a measurement that takes long gets its share of a busy machine.

        Parameters
        ----------
        took_s
            How long the last panorama took; composing would take all there is.
        """
        if not self._answer.done() and monotonic() - self._asked_s > _LONG_S:
            wait([self._answer], _ROOM * took_s)
