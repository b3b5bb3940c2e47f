"""How the page is encrypted: with the user's certificate, or with one of the viewer's own."""

import os
import socket
import ssl
from collections.abc import Iterable
from datetime import datetime, timezone
from hashlib import sha256
from pathlib import Path
from typing import NamedTuple

from fisheye_core.errors import SettingError
from panorama_viewer.settings import ViewerSettings


class Tls(NamedTuple):
    """How to encrypt, the viewer's own certificate (PEM; empty for the user's), and its file."""

    context: ssl.SSLContext
    own: bytes
    path: Path


def tls_of(settings: ViewerSettings, addresses: Iterable[str]) -> Tls | None:
    """Return how to serve as the settings say; None for http.

    Parameters
    ----------
    settings
        `https`, `certificate` and `key`.
    addresses
        Under which others reach this machine: an own certificate names them.

    Raises
    ------
    SettingError
        If certificate and key cannot be used together, or `host` is no name of a host.
    FileAccessError
        If the own certificate cannot be read or written.
    """
    if not settings.https:
        return None
    if settings.key and not settings.certificate:
        raise SettingError(f"key is '{settings.key}', but certificate is empty; expected both")
    if settings.certificate:
        path, key = Path(settings.certificate), Path(settings.key or settings.certificate)
        return Tls(_context(path, key), b'', path)
    path = Path(os.environ.get('ROS_HOME') or '~/.ros').expanduser() / 'panorama_viewer.pem'
    # Not before: the library behind it takes time and memory, and most pages go without.
    from panorama_viewer.certificate import kept_certificate

    now = datetime.now(timezone.utc)
    own = kept_certificate(path, {*_own_names(), settings.host, *addresses}, now)
    return Tls(_context(path, path), own, path)


def _own_names() -> list[str]:
    name = socket.gethostname().lower()
    return ['localhost', name, f'{name}.local', '127.0.0.1', '::1']


def _context(certificate: Path, key: Path) -> ssl.SSLContext:
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    for name, path in (('certificate', certificate), ('key', key)):
        if not path.is_file():  # a FIFO would be waited for
            raise SettingError(f"{name} is '{path}', which is no file; expected one in PEM")
    try:
        # Without a password OpenSSL would ask for one on the terminal.
        context.load_cert_chain(certificate, key, password='')
    except OSError as error:
        raise SettingError(
            f"certificate '{certificate}' and key '{key}' cannot be used: {error}; expected a "
            'certificate and its key in PEM, without a password'
        ) from error
    return context


def fingerprint(certificate: bytes) -> str:
    """Return what a browser shows of a certificate (PEM): SHA-256, in pairs of digits."""
    return sha256(ssl.PEM_cert_to_DER_cert(certificate.decode())).digest().hex(':').upper()
