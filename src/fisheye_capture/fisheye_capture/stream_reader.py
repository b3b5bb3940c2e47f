"""The process that reads a network stream for a `StreamSource`: a picture for each request."""

import os
import socket
import sys
from contextlib import suppress

import numpy as np

from fisheye_capture.network_address import StreamError
from fisheye_capture.network_request import StreamRequest
from fisheye_capture.shared_frames import Slots, receive, send
from fisheye_capture.stream_camera import StreamCamera, StreamPicture

_PIXELS = {'bgr8': 'bgr24', 'rgb8': 'rgb24', 'mono8': 'gray'}
"""Names of encodings in FFmpeg."""
_NOTE_S = 0.5
"""How often it is looked whether there is something to say while no picture comes."""


def main() -> None:
    """Answer requests until nobody asks any more."""
    channel = socket.socket(fileno=int(sys.argv[1]))
    message, _ = receive(channel)
    # The threads that wait for the camera cannot be ended: this process is.
    with suppress(BrokenPipeError):
        try:
            _serve(channel, StreamRequest(**message))
        except StreamError as error:
            send(channel, {'lost': str(error)})
    os._exit(0)


def _serve(channel, request):
    camera, slots, note = StreamCamera(request), Slots(), ''
    while message := receive(channel)[0]:
        while (picture := camera.picture(_NOTE_S)) is None:
            if camera.note != note:
                note = camera.note
                send(channel, {'note': note})
        _answer(channel, slots, message['slot'], picture, request.encoding, camera)
        note = camera.note


def _answer(channel, slots, slot, picture: StreamPicture, encoding, camera):
    answer = {
        'stamp_ns': picture.stamp_ns,
        'damaged': camera.damaged,
        'skipped': camera.skipped,
        'note': camera.note,
    }
    if picture.jpeg is not None:
        pixels, shape = np.frombuffer(picture.jpeg, np.uint8), [len(picture.jpeg)]
        target, files = slots.fit(slot, pixels.size)
        target[:] = pixels
    else:
        frame = picture.frame.reformat(format=_PIXELS[encoding])
        channels = 1 if encoding == 'mono8' else 3
        width, height, plane = frame.width, frame.height, frame.planes[0]
        shape = [height, width] if channels == 1 else [height, width, channels]
        target, files = slots.fit(slot, width * height * channels)
        rows = np.frombuffer(plane, np.uint8).reshape(height, plane.line_size)
        np.copyto(target.reshape(height, -1), rows[:, : width * channels])
    send(channel, {**answer, 'shape': shape}, files)
    for file in files:
        os.close(file)


if __name__ == '__main__':
    main()
