"""A network camera for tests: JPEG pictures over HTTP that can stop, stall and send garbage."""

from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from threading import Event, Thread

import cv2
import numpy as np


def jpeg(level: int, width: int = 64, height: int = 48) -> bytes:
    """Return a plain grey JPEG."""
    return cv2.imencode('.jpg', np.full((height, width, 3), level, np.uint8))[1].tobytes()


class MjpegServer:
    """Serves `picture` at `rate_hz` to whoever asks, on a port of its own.

    Attributes
    ----------
    picture
        The bytes to send; changing them shows at once.
    stalled
        Set: connections stay open and nothing is sent.
    connections
        How many were opened so far.
    """

    def __init__(self, picture: bytes, *, rate_hz: float = 50.0, port: int = 0):
        self.picture, self.connections = picture, 0
        self.stalled = Event()
        self._stopping = Event()
        self._period_s = 1 / rate_hz
        camera = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self):
                camera._serve(self)

            def log_message(self, *arguments):
                pass

        self._server = ThreadingHTTPServer(('127.0.0.1', port), Handler)
        self._thread = Thread(target=self._server.serve_forever, args=(0.01,), daemon=True)
        self._thread.start()
        self.port = self._server.server_port

    @property
    def url(self) -> str:
        """Where the camera is."""
        return f'http://127.0.0.1:{self.port}/stream'

    def stop(self) -> None:
        """Drop every connection and free the port."""
        self._stopping.set()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join()

    def _serve(self, request):
        self.connections += 1
        request.send_response(200)
        request.send_header('Content-Type', 'multipart/x-mixed-replace; boundary=frame')
        request.end_headers()
        try:
            while not self._stopping.wait(self._period_s):
                if not self.stalled.is_set():
                    picture = self.picture
                    head = f'--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {len(picture)}'
                    request.wfile.write(head.encode() + b'\r\n\r\n' + picture + b'\r\n')
        except OSError:
            pass  # The reader went away.
