"""Real network cameras for tests, on loopback: each picture has its own time painted in.

As a command it prints the address of its stream, then serves until it is ended.
"""

import argparse
import random
import re
import socket
import tempfile
import time
from base64 import b64encode
from collections.abc import Callable, Iterator
from contextlib import suppress
from fractions import Fraction
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer
from itertools import count
from pathlib import Path
from socketserver import StreamRequestHandler, ThreadingTCPServer
from threading import Condition, Lock, Thread

import av
import cv2
import numpy as np
from av.video.frame import PictureType

from fisheye_testing.painted_time import paint

HOST = '127.0.0.1'
CLOCK_HZ = 90_000
_MARK = b'$'


def pictures(width: int, height: int, rate_hz: float) -> Iterator[np.ndarray]:
    """Yield a moving scene (height, width, 3) at a rate, each picture with its time."""
    noise = np.random.default_rng(1).integers(40, 200, (height, 2 * width, 3), np.uint8)
    scene = cv2.GaussianBlur(noise, (0, 0), 5)
    start_s = time.monotonic()
    for number in count():
        time.sleep(max(0.0, start_s + number / rate_hz - time.monotonic()))
        at = number * 4 % width
        image = scene[:, at : at + width].copy()
        paint(image, time.time_ns())
        yield image


class Encoder:
    """Codes pictures and muxes them to a URL or a file; runs in a thread of its own."""

    def __init__(self, url: str, container: str, options: dict[str, str], arguments, relay=None):
        self._output = av.open(url, 'w', format=container, options=options)
        codec = {'h264': 'libx264', 'h265': 'libx265', 'mjpeg': 'mjpeg'}[arguments.codec]
        stream = self._output.add_stream(codec, rate=round(arguments.rate))
        stream.width, stream.height = arguments.width, arguments.height
        stream.pix_fmt = 'yuvj420p' if arguments.codec == 'mjpeg' else 'yuv420p'
        stream.codec_context.time_base = Fraction(1, CLOCK_HZ)
        stream.bit_rate = 8_000_000
        gop = max(1, round(arguments.gop * arguments.rate))
        if codec == 'libx264':
            stream.options = {
                'preset': 'ultrafast',
                'tune': '' if arguments.b_frames else 'zerolatency',
                'x264-params': f'keyint={gop}:min-keyint={gop}:scenecut=0:repeat-headers=1'
                f':bframes={arguments.b_frames}:slices=1:sliced-threads=0',
            }
            stream.options = {name: value for name, value in stream.options.items() if value}
        if arguments.codec == 'mjpeg':
            stream.options = {'huffman': 'default', 'force_duplicated_matrix': '1'}
        stream.codec_context.thread_count = 1
        self._stream, self._arguments, self._relay = stream, arguments, relay
        Thread(target=self._run, daemon=True).start()

    def _run(self):
        arguments = self._arguments
        start_ns = None
        for image in pictures(arguments.width, arguments.height, arguments.rate):
            now_ns = time.time_ns()
            start_ns = start_ns or now_ns
            frame = av.VideoFrame.from_ndarray(image, format='bgr24')
            frame.pts = (now_ns - start_ns) * CLOCK_HZ // 10**9
            frame.time_base = Fraction(1, CLOCK_HZ)
            if self._relay and self._relay.has_new and not arguments.join_late:
                # As cameras do it: who comes anew is sent a keyframe.
                self._relay.has_new, frame.pict_type = False, PictureType.I
            for packet in self._stream.encode(frame):
                self._output.mux(packet)


class Relay:
    """Hands on the datagrams that come to a port, less those that are to be lost."""

    def __init__(self, loss: float):
        self._loss = loss
        self._random = random.Random(3)
        self._targets: list[Callable[[int, bytes], object]] = []
        self._lock = Lock()
        self.has_new = False
        while True:
            first, second = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in 'ab')
            first.bind((HOST, 0))
            self.port = first.getsockname()[1]
            try:
                second.bind((HOST, self.port + 1))
                break
            except OSError:
                first.close()
        for channel, source in enumerate((first, second)):
            source.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4_000_000)
            Thread(target=self._run, args=(channel, source), daemon=True).start()

    def add(self, send) -> None:
        """Call `send` with the channel, 0 or 1, and each datagram from now on."""
        with self._lock:
            self._targets.append(send)
            self.has_new = True

    def remove(self, send) -> None:
        """Call it no more."""
        with self._lock, suppress(ValueError):
            self._targets.remove(send)

    def _run(self, channel, source):
        while True:
            datagram = source.recv(65536)
            if channel == 0 and self._random.random() < self._loss:
                continue
            with self._lock:
                targets = list(self._targets)
            for send in targets:
                try:
                    send(channel, datagram)
                except OSError:
                    self.remove(send)


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


class HttpServer:
    """An HTTP camera: `/stream` as multipart JPEG, `/snapshot`, `/live.ts`, `/hls/...`."""

    def __init__(self, arguments, relay: Relay | None = None, folder: str = ''):
        camera = self

        class Handler(SimpleHTTPRequestHandler):
            protocol_version = 'HTTP/1.1'

            def do_GET(self):
                camera._serve(self, super().do_GET)

            def log_message(self, *_):
                pass

        self._arguments, self._relay = arguments, relay
        self._jpeg, self._came = b'', Condition()

        class Server(ThreadingHTTPServer):
            daemon_threads = True

            def handle_error(self, request, client_address):
                """Leave it unsaid that a reader went away in the middle."""

        server = Server((HOST, arguments.port), partial(Handler, directory=folder or '/nowhere'))
        self.address = f'http://{HOST}:{server.server_port}'
        Thread(target=server.serve_forever, daemon=True).start()
        if not relay and not folder:
            Thread(target=self._run, daemon=True).start()

    def _run(self):
        arguments = self._arguments
        for image in pictures(arguments.width, arguments.height, arguments.rate):
            jpeg = cv2.imencode('.jpg', image)[1].tobytes()
            if random.random() < arguments.loss:
                jpeg = jpeg[: len(jpeg) // 2]
            with self._came:
                self._jpeg = jpeg
                self._came.notify_all()

    def _next(self):
        with self._came:
            self._came.wait()
            return self._jpeg

    def _serve(self, request: BaseHTTPRequestHandler, serve_file):
        path = request.path.partition('?')[0]
        wanted = 'Basic ' + b64encode(f'user:{self._arguments.password}'.encode()).decode()
        with suppress(OSError):
            if self._arguments.password and request.headers.get('Authorization') != wanted:
                request.send_response(401)
                request.send_header('WWW-Authenticate', 'Basic realm="camera"')
                request.send_header('Content-Length', '0')
                request.end_headers()
            elif path == '/redirect':
                request.send_response(302)
                request.send_header('Location', self._arguments.redirect)
                request.send_header('Content-Length', '0')
                request.end_headers()
            elif path == '/snapshot':
                jpeg = self._next()
                request.send_response(200)
                request.send_header('Content-Type', 'image/jpeg')
                request.send_header('Content-Length', str(len(jpeg)))
                request.end_headers()
                request.wfile.write(jpeg)
            elif path == '/stream':
                self._head(request, 'multipart/x-mixed-replace; boundary=frame')
                while jpeg := self._next():
                    head = f'--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}'
                    request.wfile.write(head.encode() + b'\r\n\r\n' + jpeg + b'\r\n')
            elif path == '/live.ts' and self._relay:
                self._head(request, 'video/mp2t')
                lost = Condition()

                def send(channel, datagram):
                    try:
                        request.wfile.write(datagram)
                    except OSError:
                        with lost:
                            lost.notify()
                        raise

                self._relay.add(send)
                with lost:
                    lost.wait()
            else:
                serve_file()

    def _head(self, request, content_type):
        request.close_connection = True
        request.send_response(200)
        request.send_header('Content-Type', content_type)
        request.end_headers()


def serve(arguments) -> str:
    """Start the camera that the arguments describe; return its address."""
    kind = arguments.kind
    if kind in ('mjpeg', 'snapshot'):
        address = HttpServer(arguments).address
        return f'{address}/{"stream" if kind == "mjpeg" else "snapshot"}'
    if kind == 'hls':
        folder = tempfile.mkdtemp()
        Path(folder, 'hls').mkdir()
        options = {'hls_time': '1', 'hls_list_size': '4', 'hls_flags': 'delete_segments'}
        Encoder(f'{folder}/hls/live.m3u8', 'hls', options, arguments)
        return f'{HttpServer(arguments, folder=folder).address}/hls/live.m3u8'
    relay = Relay(arguments.loss)
    if kind == 'rtsp':
        Encoder(f'rtp://{HOST}:{relay.port}?pkt_size=1400', 'rtp', {}, arguments, relay)
        return RtspServer(relay, arguments).url
    target = f'udp://{HOST}:{relay.port}?pkt_size=1316'
    Encoder(target, 'mpegts', {'flush_packets': '1', 'pat_period': '0.1'}, arguments, relay)
    if kind == 'ts':
        return f'{HttpServer(arguments, relay).address}/live.ts'
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    if not arguments.port:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind((HOST, 0))
            arguments.port = free.getsockname()[1]
    relay.add(lambda channel, datagram: _send(udp, datagram, arguments.port))
    return f'udp://{HOST}:{arguments.port}'


def _send(udp, datagram, port):
    with suppress(ConnectionRefusedError):  # Nobody listens yet.
        udp.sendto(datagram, (HOST, port))


def main() -> None:
    """Serve until a signal comes."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('kind', choices=['rtsp', 'udp', 'ts', 'mjpeg', 'snapshot', 'hls'])
    parser.add_argument('--codec', choices=['h264', 'mjpeg'], default='h264')
    parser.add_argument('--port', type=int, default=0)
    parser.add_argument('--width', type=int, default=640)
    parser.add_argument('--height', type=int, default=480)
    parser.add_argument('--rate', type=float, default=30.0, help='pictures a second')
    parser.add_argument('--gop', type=float, default=1.0, help='s between keyframes')
    parser.add_argument('--join-late', action='store_true', help='no keyframe for who comes')
    parser.add_argument('--b-frames', type=int, default=0)
    parser.add_argument('--loss', type=float, default=0.0, help='share of what is sent')
    parser.add_argument('--password', default='', help='of the user called user')
    parser.add_argument('--redirect', default='', help='where /redirect leads')
    print(serve(parser.parse_args()), flush=True)
    with suppress(KeyboardInterrupt):
        while True:
            time.sleep(60)


if __name__ == '__main__':
    main()
