"""What FFmpeg is told to open a network camera, and what its refusals mean."""

import errno
from dataclasses import dataclass

import av

from fisheye_capture.network_request import StreamRequest
from fisheye_core import ffmpeg_log

_PROTOCOLS = {
    'http': 'http,https,httpproxy,tcp,tls,crypto',
    'rtsp': 'rtsp,rtsps,rtp,rtcp,srtp,udp,tcp,tls,http,https',
    'udp': 'udp',
}
_PROTOCOLS |= {'https': _PROTOCOLS['http'], 'rtsps': _PROTOCOLS['rtsp']}
"""What a camera of each scheme may lead to, by redirects and playlists too: no file of ours."""
_PROBE_US = 300_000
_PROBE_BYTES = 8_000_000
"""A keyframe of 4K."""


class StreamError(Exception):
    """A network camera cannot be opened or was lost; the message is a sentence."""


@dataclass(frozen=True)
class Opened:
    """A network camera that answered; `is_lossy` if some of what it sent since then was lost."""

    container: 'av.container.InputContainer'
    is_lossy: bool


def open_camera(request: StreamRequest) -> Opened:
    """Open a network camera.

    Raises
    ------
    StreamError
        If nothing answers, or what answers is no camera.
    """
    options = {
        'protocol_whitelist': _PROTOCOLS[request.scheme],
        'analyzeduration': str(_PROBE_US),
        'probesize': str(_PROBE_BYTES),
        'fpsprobesize': '0',
        'live_start_index': '-1',
    }
    if request.scheme in ('rtsp', 'rtsps'):
        options |= {'rtsp_transport': request.rtsp_transport, 'allowed_media_types': 'video'}
    if request.scheme == 'udp':
        # A transport stream packs a picture in a packet: to look for its end costs another one.
        options |= {'fflags': 'noparse+nofillin', 'fifo_size': '100000', 'overrun_nonfatal': '1'}
    timeout_s = request.connect_timeout_s, max(request.connect_timeout_s, request.silence_s, 1.0)
    try:
        with ffmpeg_log.captured() as said:
            container = av.open(request.url, options=options, timeout=timeout_s)
    except (av.error.FFmpegError, OSError, ValueError) as error:
        raise StreamError(refusal(request, error)) from error
    if not container.streams.video:
        raise StreamError(f'{request.shown} holds no video; is it the address of its stream?')
    return Opened(container, tells_of_loss(said))


def tells_of_loss(said: list[tuple[int, str, str]]) -> bool:
    """Whether something that FFmpeg said is that packets got lost."""
    return any('missed' in line for _, _, line in said)


def refusal(request: StreamRequest, error: Exception) -> str:
    """Explain in a sentence why a camera could not be opened, and what to do."""
    shown = request.shown
    kinds = {
        av.error.HTTPUnauthorizedError: 'refuses the user or password (401)',
        av.error.HTTPForbiddenError: 'denies this user access (403)',
        av.error.HTTPNotFoundError: 'has no such path (404); expected the address of its stream',
        av.error.HTTPClientError: 'refuses the request (4xx); is the path right?',
        av.error.HTTPServerError: 'reports an error of its own (5xx); are there too many viewers?',
        av.error.ConnectionRefusedError: 'refuses the connection; is the port right, and the '
        'camera ready?',
        av.error.ExitError: f'gave no picture data within {request.connect_timeout_s:g} s; is it '
        'on, and the address right?',
        av.error.InvalidDataError: 'answers with something that is not a video; is it the '
        'address of its stream?',
    }
    kinds[av.error.TimeoutError] = kinds[av.error.ExitError]
    for kind, reason in kinds.items():
        if isinstance(error, kind):
            return f'{shown} {reason}'
    code = getattr(error, 'errno', None)
    if code in (errno.EHOSTUNREACH, errno.ENETUNREACH):
        return f'{shown} cannot be reached from this network'
    if code == errno.EIO:
        return f'{shown} cannot be found; is the name of the host right?'
    if code == errno.EINVAL:
        return f'{shown} leads to what a camera may not lead to, or its address has a mistake'
    return f'{shown} cannot be opened: {_words(error)}'


def loss(request: StreamRequest, error: Exception) -> str:
    """Explain in a sentence why a camera that was open sends nothing any more."""
    if isinstance(error, (av.error.ExitError, av.error.TimeoutError)):
        reason = f'nothing came for {request.silence_s:g} s'
    elif getattr(error, 'errno', None) == errno.EIO:
        reason = 'the connection broke off'
    else:
        reason = _words(error)
    return f'{request.shown} stopped sending pictures: {reason}'


def _words(error: Exception) -> str:
    return getattr(error, 'strerror', None) or type(error).__name__
