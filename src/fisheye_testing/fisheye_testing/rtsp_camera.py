"""A network camera that speaks RTSP."""

import re
import socket
from base64 import b64encode
from contextlib import suppress
from socketserver import StreamRequestHandler, ThreadingTCPServer
from threading import Lock, Thread

from fisheye_testing.camera_encoder import CLOCK_HZ
from fisheye_testing.datagram_relay import HOST, Relay

_MARK = b'$'


class RtspServer:
    """An RTSP camera (RFC 2326) over TCP or UDP; FFmpeg makes its RTP and sender reports."""

    def __init__(self, relay: Relay, arguments):
        server = self

        class Session(StreamRequestHandler):
            def handle(self):
                server._serve(self)

        class Server(ThreadingTCPServer):
            allow_reuse_address = daemon_threads = True

        self._relay, self._arguments = relay, arguments
        self._server = Server((HOST, arguments.port), Session)
        self.url = f'rtsp://{HOST}:{self._server.server_address[1]}/live'
        Thread(target=self._server.serve_forever, daemon=True).start()

    def _serve(self, session):
        send, lock = None, Lock()
        with suppress(OSError):
            while line := session.rfile.readline():
                if line[:1] == _MARK:  # A receiver report; what follows it is no line.
                    rest = line[1:] + session.rfile.read(max(0, 4 - len(line)))
                    size = int.from_bytes(rest[1:3], 'big')
                    session.rfile.read(size - (len(rest) - 3))
                    continue
                method, url, _ = line.decode().split()
                headers = {}
                while entry := session.rfile.readline().decode().strip():
                    name, _, value = entry.partition(':')
                    headers[name.lower()] = value.strip()
                status, answer, body = self._answer(method, url, headers)
                if method == 'SETUP' and status == '200 OK':
                    send, answer['Transport'] = self._sender(session, headers['transport'], lock)
                answer['CSeq'] = headers['cseq']
                if body:
                    answer['Content-Length'] = str(len(body))
                head = ''.join(f'{name}: {value}\r\n' for name, value in answer.items())
                with lock:
                    session.wfile.write(f'RTSP/1.0 {status}\r\n{head}\r\n{body}'.encode())
                if method == 'PLAY' and send:
                    self._relay.add(send)
                if method == 'TEARDOWN':
                    break
        if send:
            self._relay.remove(send)

    def _answer(self, method, url, headers):
        arguments = self._arguments
        if method == 'OPTIONS':
            return '200 OK', {'Public': 'OPTIONS, DESCRIBE, SETUP, PLAY, TEARDOWN'}, ''
        if arguments.password:
            wanted = 'Basic ' + b64encode(f'user:{arguments.password}'.encode()).decode()
            if headers.get('authorization') != wanted:
                return '401 Unauthorized', {'WWW-Authenticate': 'Basic realm="camera"'}, ''
        if '/live' not in url:
            return '404 Not Found', {}, ''
        if method == 'DESCRIBE':
            payload, name = (26, 'JPEG') if arguments.codec == 'mjpeg' else (96, 'H264')
            body = (
                f'v=0\r\no=- 0 0 IN IP4 {HOST}\r\ns=camera\r\nc=IN IP4 0.0.0.0\r\nt=0 0\r\n'
                f'm=video 0 RTP/AVP {payload}\r\na=rtpmap:{payload} {name}/{CLOCK_HZ}\r\n'
                + ('' if payload == 26 else 'a=fmtp:96 packetization-mode=1\r\n')
                + 'a=control:track\r\n'
            )
            return '200 OK', {'Content-Type': 'application/sdp', 'Content-Base': url + '/'}, body
        return '200 OK', {'Session': '1234'}, ''

    def _sender(self, session, transport, lock):
        if 'TCP' in transport:

            def send(channel, datagram):
                head = _MARK + bytes([channel]) + len(datagram).to_bytes(2, 'big')
                with lock:
                    session.wfile.write(head + datagram)

            return send, 'RTP/AVP/TCP;unicast;interleaved=0-1'
        ports = [int(p) for p in re.findall(r'\d+', transport.partition('client_port=')[2])[:2]]
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        address = session.client_address[0]
        text = f'RTP/AVP;unicast;client_port={ports[0]}-{ports[1]};server_port=6970-6971'
        return (lambda channel, datagram: udp.sendto(datagram, (address, ports[channel]))), text
