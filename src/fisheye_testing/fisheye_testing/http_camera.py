"""A network camera that speaks HTTP."""

import random
from base64 import b64encode
from contextlib import suppress
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer
from threading import Condition, Thread

import cv2

from fisheye_testing.camera_encoder import pictures
from fisheye_testing.datagram_relay import HOST, Relay


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
