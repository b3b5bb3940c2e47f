import re
import socket
from contextlib import closing
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp
import pytest
from serving import DEADLINE_S, address, answered, here, request, token, visit

import panorama_viewer
from fisheye_core.errors import OverlapError, SettingError
from panorama_viewer.server import ViewerServer
from panorama_viewer.settings import ViewerSettings

WEB = Path(panorama_viewer.__file__).parent / 'web'


def test_the_page_is_there_and_needs_nothing_from_elsewhere(serve):
    server = serve()
    for name in ('', *(path.name for path in WEB.iterdir())):
        status, body, headers = request('GET', address(server, name))
        assert status == 200
        assert "default-src 'self'" in headers['Content-Security-Policy']
        assert headers['X-Content-Type-Options'] == 'nosniff'
        links = re.findall(rb'https?://[^"\s]+', body)
        assert set(links) <= {b'http://www.w3.org/2000/svg'}


@pytest.mark.parametrize(
    'path',
    [
        'viewer_node.py',
        '..%2fviewer_node.py',
        '%2e%2e/viewer_node.py',
        '/etc/passwd',
        'web/main.js',
    ],
)
def test_no_other_file_can_be_had(serve, path):
    server = urlsplit(address(serve(), ''))
    with closing(HTTPConnection(server.hostname, server.port)) as connection:
        connection.request('GET', f'/{path}')  # word for word, where other clients would tidy it
        assert connection.getresponse().status == 404


@pytest.mark.parametrize(
    ('headers', 'status'),
    [
        ({'Host': 'elsewhere.example'}, 403),
        ({'Host': 'elsewhere.example:8080'}, 403),
        ({'Host': '192.0.2.7:8080'}, 200),
        ({'Host': 'localhost:9000'}, 200),
        ({'Host': '[::1]:8080'}, 200),
        ({'Host': 'localhost', 'Origin': 'http://elsewhere.example'}, 403),
        ({'Host': 'localhost', 'Origin': 'null'}, 403),
        ({'Host': 'localhost', 'Origin': 'http://['}, 403),
        ({'Host': '[', 'Origin': 'http://['}, 403),
        ({'Host': 'localhost:80', 'Origin': 'http://localhost:80'}, 200),
    ],
)
def test_other_sites_are_refused(serve, headers, status):
    server = serve()
    for method, path in (('GET', ''), ('POST', 'calibrate')):
        assert request(method, address(server, path), headers=headers)[0] == status

    async def look(session):
        async with session.ws_connect(address(server, 'live'), headers=headers):
            return 101

    if status == 403:
        with pytest.raises(aiohttp.WSServerHandshakeError):
            visit(look)


@pytest.mark.parametrize('header', [b'Host: \xff\xfe', b'Host: localhost\r\nX-Token: \xff\xfe'])
def test_bytes_that_are_no_text_are_refused(serve, header):
    port = int(serve(host='0.0.0.0').url.split(':')[2].split('/')[0])
    with socket.create_connection(('127.0.0.1', port), timeout=DEADLINE_S) as connection:
        connection.sendall(b'POST /calibrate HTTP/1.1\r\n' + header + b'\r\n\r\n')
        assert connection.recv(100).split()[1] in (b'400', b'403')


def test_only_who_knows_the_token_may_press_buttons_from_elsewhere(serve):
    pressed = []
    server = serve(lambda: pressed.append(1) or answered('measured'), host='0.0.0.0')
    assert token(server)
    for button in ('calibrate', 'snapshot'):
        for headers in ({}, {'X-Token': 'guess'}, {'X-Token': ''}):
            status, words, _ = request('POST', here(server, button), headers=headers)
            assert status == 403
            assert b'token' in words
    assert not pressed
    status, words, _ = request(
        'POST', here(server, 'calibrate'), headers={'X-Token': token(server)}
    )
    assert (status, words) == (200, b'measured')


def test_no_token_is_needed_where_only_this_machine_can_look(serve):
    server = serve()
    assert server.url.endswith('/')
    assert request('POST', address(server, 'calibrate'))[:2] == (200, b'measured')
    assert request('GET', address(server, 'calibrate'))[0] == 405


def test_a_calibration_that_fails_says_why(serve):
    def fail():
        raise OverlapError('nobody is there')

    status, words, _ = request('POST', address(serve(fail), 'calibrate'))
    assert (status, words) == (503, b'nobody is there')


def test_a_snapshot_is_the_newest_picture(serve):
    server = serve()
    assert request('POST', address(server, 'snapshot'))[0] == 503
    server.show(b'jpeg')
    status, body, headers = request('POST', address(server, 'snapshot'))
    assert (status, body, headers['Content-Type']) == (200, b'jpeg', 'image/jpeg')


def unserved(**settings):
    return ViewerServer(ViewerSettings(**settings), calibrate=None, watched=None, report=None)


def test_a_port_in_use_is_a_sentence():
    with socket.socket() as other:
        other.bind(('127.0.0.1', 0))
        other.listen()
        port = other.getsockname()[1]
        server = unserved(port=port)
        with pytest.raises(SettingError, match=f'port {port} of 127.0.0.1 is in use'):
            server.start()


@pytest.mark.skipif(not socket.has_dualstack_ipv6(), reason='this machine has no IPv6')
def test_every_address_of_ipv6_are_those_of_ipv4_too(serve):
    server = serve(host='::')
    assert request('GET', here(server))[0] == 200


def test_an_address_of_another_machine_is_a_sentence():
    server = unserved(host='203.0.113.7', port=0)
    with pytest.raises(SettingError, match=r'cannot serve on port 0 of 203\.0\.113\.7'):
        server.start()


def test_a_name_that_cannot_be_one_is_a_sentence():
    server = unserved(host='....', port=0)
    with pytest.raises(SettingError, match=r'cannot serve on port 0 of \.\.\.\.: '):
        server.start()
