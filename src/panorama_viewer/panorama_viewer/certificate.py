"""The viewer's own certificate for https, kept between runs."""

import socket
from collections.abc import Iterable
from datetime import datetime, timedelta, timezone
from ipaddress import ip_address, ip_network
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from fisheye_core.errors import FileAccessError, SettingError
from fisheye_core.regular_file import replace_regular

_VALID = timedelta(days=820)
"""iPhones believe none that is valid for more than 825 days."""
_RENEWED = timedelta(days=60)
"""Before its end: a viewer runs for days, and phones have to be told of a new one."""


def kept_certificate(path: Path, names: Iterable[str], now: datetime) -> bytes:
    """Return the certificate (PEM) in a file that holds its key too.

    A new one is made, readable for its owner only, where there is none, where it does not name
    all names and addresses, and some weeks before it ends.

    Parameters
    ----------
    path
        Of the file.
    names
        Host names and addresses.
    now
        With its zone.

    Raises
    ------
    FileAccessError
        If the file cannot be read or written.
    SettingError
        If a name is none that a host can have.
    """
    wanted = {_general_name(name) for name in names}
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if path.exists() and (kept := _usable(path.read_bytes(), wanted, now)):
            return kept
        certificate, key = _made(wanted, now)
        replace_regular(path, (key + certificate).decode(), mode=0o600)
    except OSError as error:
        raise FileAccessError(path, 'used as certificate', error.strerror) from error
    return certificate


def _general_name(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(name))
    except ValueError:
        pass
    try:
        return x509.DNSName(name.encode('idna').decode())
    except UnicodeError as error:
        raise SettingError(
            f"the host name '{name}' cannot be in a certificate; expected words of 1 to 63 "
            'letters with dots between, or an address'
        ) from error


def _usable(content: bytes, wanted: set[x509.GeneralName], now: datetime) -> bytes | None:
    """Return the certificate in a file's content if it names all that is wanted and lasts."""
    try:
        certificate = x509.load_pem_x509_certificate(content)
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except (ValueError, x509.ExtensionNotFound):
        return None
    ends = getattr(certificate, 'not_valid_after_utc', None)
    # Before cryptography 42 its times had no zone.
    ends = ends or certificate.not_valid_after.replace(tzinfo=timezone.utc)
    if ends - now < _RENEWED or not wanted <= set(names.value):
        return None
    return certificate.public_bytes(Encoding.PEM)


def _made(names: set[x509.GeneralName], now: datetime) -> tuple[bytes, bytes]:
    """Make a certificate and its key, both PEM.

    It is an authority, because phones can be told to trust no other; but only for its own names,
    so that nobody who got hold of the key could play another site to those phones (RFC 5280,
    section 4.2.1.10).
    """
    key = ec.generate_private_key(ec.SECP256R1())
    title = f'{socket.gethostname():.50} panorama'
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, title)])
    # Of the usages below the first is to sign handshakes, the sixth to sign certificates.
    builder = (
        x509.CertificateBuilder(subject, subject, key.public_key(), x509.random_serial_number())
        .not_valid_before(now - timedelta(days=1))  # clocks differ
        .not_valid_after(now + _VALID)
    )
    for extension, is_critical in (
        (x509.SubjectAlternativeName(sorted(names, key=str)), False),
        (x509.BasicConstraints(ca=True, path_length=0), True),
        (x509.NameConstraints([_subtree(name) for name in sorted(names, key=str)], None), True),
        (x509.KeyUsage(True, False, False, False, False, True, False, False, False), True),
        (x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), False),
        (x509.SubjectKeyIdentifier.from_public_key(key.public_key()), False),
    ):
        builder = builder.add_extension(extension, is_critical)
    certificate = builder.sign(key, SHA256()).public_bytes(Encoding.PEM)
    return certificate, key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())


def _subtree(name: x509.GeneralName) -> x509.GeneralName:
    if isinstance(name, x509.IPAddress):
        return x509.IPAddress(ip_network(name.value))
    return name
