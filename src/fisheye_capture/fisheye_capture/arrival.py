"""When the pictures of a network stream came in, freed of the hiccups of the network."""

_WINDOW_NS = 5_000_000_000
"""A hiccup may last so long; a clock that is 0.1 % wrong errs by 10 ms within twice that."""
_JUMP_NS = 10_000_000_000
"""By so much no network delays a picture: the stream's times began anew."""


class ArrivalClock:
    """Clock that maps times of the stream to times of arrival, as if no picture had been held up.

    After a hiccup pictures come in a burst. Their own times say how far apart they were taken, and
    those that came without delay, how the two clocks lie: the smallest difference of late.
    """

    def __init__(self):
        self._smallest_ns: int | None = None
        self._former_ns = 0
        self._since_ns = 0

    def stamp_ns(self, media_ns: int | None, arrival_ns: int) -> int:
        """Return when a picture would have come without delay, ns since the epoch.

        Parameters
        ----------
        media_ns
            Its time in the stream; None if it has none.
        arrival_ns
            When it came, ns since the epoch.
        """
        if media_ns is None:
            return arrival_ns
        offset_ns = arrival_ns - media_ns
        if self._smallest_ns is None or abs(offset_ns - self._smallest_ns) > _JUMP_NS:
            self._smallest_ns, self._former_ns, self._since_ns = offset_ns, offset_ns, arrival_ns
        if arrival_ns - self._since_ns > _WINDOW_NS:
            self._former_ns, self._smallest_ns = self._smallest_ns, offset_ns
            self._since_ns = arrival_ns
        self._smallest_ns = min(self._smallest_ns, offset_ns)
        return media_ns + min(self._smallest_ns, self._former_ns)
