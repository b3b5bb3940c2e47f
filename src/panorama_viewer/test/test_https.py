"""The page encrypted: certificates, and what goes wrong with them."""

import asyncio
import socket
import ssl
from contextlib import nullcontext, suppress
from datetime import datetime, timedelta, timezone
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import serialization
from serving import DEADLINE_S, address, picture, state, visit

from fisheye_core.errors import FileAccessError, SettingError
from panorama_viewer.certificate import kept_certificate
from panorama_viewer.settings import ViewerSettings
from panorama_viewer.tls import fingerprint, tls_of

NAMES = 'robot', 'robot.local', '127.0.0.1', 'fd00::7'
NOW = datetime(2026, 6, 1, tzinfo=timezone.utc)


@pytest.fixture
def tls(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    return tls_of(ViewerSettings(https=True), {'192.0.2.9'})


def trusting(certificate):
    """Return how a client asks that trusts a certificate, and no other."""
    return ssl.create_default_context(cadata=certificate.decode())


def test_a_client_that_trusts_the_certificate_sees_the_page_and_the_picture(serve, tls):
    server = serve(tls=tls)
    assert server.address.startswith('https://127.0.0.1:')
    with urlopen(f'{server.address}certificate.crt', context=trusting(tls.own)) as reply:
        assert reply.headers['Content-Type'] == 'application/x-x509-ca-cert'
        body = reply.read()
    assert is_served(server, body)

    async def scenario(session):
        look = session.ws_connect(address(server, 'live'), ssl=trusting(body))
        async with look as stream:
            await state(stream, lambda _: True)
            server.show(b'picture')
            assert await picture(stream) == b'picture'
            used = stream.get_extra_info('socket')
        while used.fileno() >= 0:
            await asyncio.sleep(0)  # TLS has its own farewell

    visit(scenario)


def is_served(server, certificate):
    # aiohttp's client leaves encrypted connections half open where only one answer is wanted.
    with urlopen(server.address, context=trusting(certificate)) as reply:
        return b'<title>Panorama' in reply.read()


def connect(server):
    place = urlsplit(server.address)
    return socket.create_connection((place.hostname, place.port), DEADLINE_S)


def is_trusted(server, context):
    """Whether a client shakes hands; aiohttp's leaves a socket open where it does not."""
    with connect(server) as client:
        try:
            context.wrap_socket(client, server_hostname='127.0.0.1').close()
        except ssl.SSLCertVerificationError:
            return False
    return True


def test_a_client_that_does_not_trust_it_goes_and_is_no_fault(serve, tls):
    server = serve(tls=tls)
    assert is_trusted(server, trusting(tls.own))
    assert not is_trusted(server, ssl.create_default_context())
    with connect(server) as client:
        client.sendall(b'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n')
        with suppress(ConnectionResetError):
            assert client.recv(1) in (b'', b'\x15'), 'the end, or an alert of TLS before it'
    assert is_served(server, tls.own)


def test_who_stays_in_the_handshake_keeps_nobody_out(serve, tls, monkeypatch):
    monkeypatch.setattr('panorama_viewer.gate.MAX_ENTERING', 2)
    server = serve(tls=tls)
    silent = [connect(server) for _ in range(9)]
    for client in silent:
        client.sendall(b'\x16')  # begins a greeting
    for client in silent[:6]:
        with suppress(ConnectionResetError):
            assert client.recv(1) == b'', 'the oldest go'
    assert is_served(server, tls.own)
    for client in silent:
        client.close()


def test_the_certificate_names_the_machine_and_is_kept_for_its_owner(tmp_path):
    path = tmp_path / 'new' / 'own.pem'
    first = kept_certificate(path, NAMES, NOW)
    assert path.stat().st_mode & 0o777 == 0o600
    assert kept_certificate(path, NAMES[1:], NOW) == first
    assert kept_certificate(path, [*NAMES, '192.0.2.8'], NOW) != first
    names = x509.load_pem_x509_certificate(first).extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert {str(name.value) for name in names.value} == set(NAMES)
    assert len(fingerprint(first)) == 32 * 3 - 1


@pytest.mark.parametrize(('later', 'is_kept'), [(750, True), (770, False), (9999, False)])
def test_a_certificate_is_made_anew_before_it_ends(tmp_path, later, is_kept):
    first = kept_certificate(tmp_path / 'own.pem', NAMES, NOW)
    second = kept_certificate(tmp_path / 'own.pem', NAMES, NOW + timedelta(days=later))
    assert (second == first) == is_kept


def test_a_file_that_holds_no_certificate_is_replaced(tmp_path):
    path = tmp_path / 'own.pem'
    for content in (b'', b'\xff\xfe', b'-----BEGIN CERTIFICATE-----\nAAAA\n'):
        path.write_bytes(content)
        assert b'BEGIN CERTIFICATE' in kept_certificate(path, NAMES, NOW)


def test_a_place_that_cannot_be_used_is_a_sentence(tmp_path):
    (tmp_path / 'file').touch()
    with pytest.raises(FileAccessError, match='used as certificate: File exists'):
        kept_certificate(tmp_path / 'file' / 'own.pem', NAMES, NOW)
    with pytest.raises(FileAccessError, match='used as certificate'):
        kept_certificate(tmp_path, NAMES, NOW)


def test_the_certificate_of_the_user_is_used(serve, tls, tmp_path):
    certificate, key = tmp_path / 'theirs.pem', tmp_path / 'key.pem'
    kept_certificate(certificate, NAMES, datetime.now(timezone.utc))
    both = certificate.read_bytes()
    key.write_bytes(both[: both.index(b'-----BEGIN CERTIFICATE')])
    for settings in ({'key': str(key)}, {}):
        theirs = tls_of(ViewerSettings(https=True, certificate=str(certificate), **settings), ())
        server = serve(tls=theirs)
        trusted = both[both.index(b'-----BEGIN CERTIFICATE') :]
        assert is_served(server, trusted)
        with pytest.raises(HTTPError, match='404'):
            urlopen(f'{server.address}certificate.crt', context=trusting(trusted))
        assert not is_trusted(server, trusting(tls.own))


@pytest.mark.parametrize('is_own', [False, True])
def test_under_which_name_a_browser_comes_is_said_by_the_users_certificate(
    serve, tls, tmp_path, is_own
):
    path = tmp_path / 'theirs.pem'
    kept_certificate(path, ['robot.example.com', '127.0.0.1'], datetime.now(timezone.utc))
    theirs = tls_of(ViewerSettings(https=True, certificate=str(path)), ())
    server = serve(tls=tls if is_own else theirs)
    asked = Request(server.address, headers={'Host': 'robot.example.com:8080'})
    trusted = trusting(tls.own) if is_own else ssl.create_default_context(cafile=path)
    with pytest.raises(HTTPError, match='403') if is_own else nullcontext():
        urlopen(asked, context=trusted).close()


def test_a_host_that_no_certificate_can_name_is_a_sentence(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    with pytest.raises(SettingError, match=r"the host name 'robot\.\.local' cannot be in a cert"):
        tls_of(ViewerSettings(https=True, host='robot..local'), ())


def test_certificates_that_cannot_be_used_are_sentences(tls, tmp_path):
    other, locked = tmp_path / 'other.pem', tmp_path / 'locked.pem'
    kept_certificate(other, NAMES, NOW)
    key = serialization.load_pem_private_key(other.read_bytes(), None)
    locked.write_bytes(
        key.private_bytes(
            serialization.Encoding.PEM,
            serialization.PrivateFormat.PKCS8,
            serialization.BestAvailableEncryption(b'word'),
        )
    )
    (tmp_path / 'text').write_text('no certificate')
    for certificate, key_path, sentence in (
        (tmp_path / 'none', '', "certificate is '.*none', which is no file"),
        (tmp_path, '', 'which is no file; expected one in PEM'),
        (other, tmp_path / 'none', "key is '.*none', which is no file"),
        (tmp_path / 'text', '', 'cannot be used: .*; expected a certificate and its key in PEM'),
        (other, tls.path, 'cannot be used: '),
        (other, locked, 'cannot be used: .*without a password'),
        ('', other, 'but certificate is empty; expected both'),
    ):
        settings = ViewerSettings(https=True, certificate=str(certificate), key=str(key_path))
        with pytest.raises(SettingError, match=sentence):
            tls_of(settings, ())


def test_http_needs_no_certificate(tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    assert tls_of(ViewerSettings(certificate='nowhere'), ()) is None
    assert not list(tmp_path.iterdir())


def test_a_viewer_that_stops_lets_who_is_in_the_handshake_go(serve, tls):
    server = serve(tls=tls)
    with connect(server) as client:
        assert is_served(server, tls.own)
        server.stop()
        assert client.recv(1) == b''
