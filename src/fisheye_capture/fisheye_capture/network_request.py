"""What the process that reads a network camera is asked for."""

from dataclasses import dataclass

SCHEMES = ('http', 'https', 'rtsp', 'rtsps', 'udp')
MAX_DIFFERENCE_NS = 5_000_000_000
"""Between the camera's clock and that of this machine, where stamps are by the former."""
_SLOW_PERIODS = 3
"""Of a camera, without anything, before it counts as lost."""


@dataclass(frozen=True)
class StreamRequest:
    """A network camera and how it is to be read.

    Attributes
    ----------
    url, shown
        Its address, its scheme in small letters, and the address as others may read it.
    """

    url: str
    shown: str
    encoding: str
    frame_rate_hz: float
    rtsp_transport: str
    connect_timeout_s: float
    silence_timeout_s: float
    first_picture_timeout_s: float
    stamp_from: str

    @property
    def scheme(self) -> str:
        """Of the URL."""
        return self.url.partition('://')[0]

    @property
    def silence_s(self) -> float:
        """How long it may send nothing before it counts as lost."""
        return max(self.silence_timeout_s, _SLOW_PERIODS / self.frame_rate_hz)
