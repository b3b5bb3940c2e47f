"""Addresses that a server is told to use, and how others reach it."""

import errno
import socket
from ipaddress import ip_address, ip_network


def is_loopback(host: str) -> bool:
    """Return whether only this machine reaches an address."""
    try:
        return host == 'localhost' or ip_address(host).is_loopback
    except ValueError:
        return False


def reachable(host: str) -> str:
    """Return the address under which others find a server that listens on `host`."""
    if host not in ('0.0.0.0', '::'):
        return f'[{host}]' if ':' in host else host
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            # Nothing is sent: it only asks which of our addresses faces the network.
            probe.connect(('192.0.2.1', 9))
            return probe.getsockname()[0]
        except OSError:
            return socket.gethostname()


def refusal(host: str, port: int, error: OSError | ValueError) -> str:
    """Return the sentence for an address that cannot be served on."""
    where = f'port {port} of {host}'
    if isinstance(error, OSError) and error.errno == errno.EADDRINUSE:
        return f'{where} is in use by another program; set the parameter port to a free one'
    return f'cannot serve on {where}: {getattr(error, "strerror", None) or error}'


def source_of(address: str) -> str:
    """Return what one client can connect from: an IPv4 address, or an IPv6 network."""
    plain = ip_address(address.partition('%')[0])
    if plain.version == 4:
        return str(plain)
    return str(plain.ipv4_mapped or ip_network((plain, 64), strict=False))
