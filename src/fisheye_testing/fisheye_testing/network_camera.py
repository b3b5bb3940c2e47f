"""Real network cameras for tests, on loopback: each picture has its own time painted in.

As a command it prints the address of its stream, then serves until it is ended.
"""

import argparse
import socket
import tempfile
import time
from contextlib import suppress
from pathlib import Path

from fisheye_testing.camera_encoder import Encoder
from fisheye_testing.datagram_relay import HOST, Relay
from fisheye_testing.http_camera import HttpServer
from fisheye_testing.rtsp_camera import RtspServer


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
    parser.add_argument('--loss', type=float, default=0.0, help='share of what is sent')
    parser.add_argument('--password', default='', help='of the user called user')
    parser.add_argument('--redirect', default='', help='where /redirect leads')
    print(serve(parser.parse_args()), flush=True)
    with suppress(KeyboardInterrupt):
        while True:
            time.sleep(60)


if __name__ == '__main__':
    main()
