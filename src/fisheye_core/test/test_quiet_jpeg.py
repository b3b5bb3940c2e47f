"""libjpeg's lines: kept from the log, and nobody else's."""

import os
import subprocess
import sys
from threading import Barrier, Thread

import cv2
import numpy as np
import pytest

from fisheye_core.coded_picture import decoded
from fisheye_core.quiet_jpeg import without_libjpeg_lines

PICTURE = np.random.default_rng(1).integers(0, 255, (48, 64, 3), np.uint8)
CODED = cv2.imencode('.jpg', PICTURE)[1].ravel()
STRAY = np.concatenate([CODED[:-2], np.full(50, 7, np.uint8), CODED[-2:]])
"""Bytes between the pixels and the end, as webcams leave them."""


def test_what_libjpeg_complains_of_is_decoded_in_silence(capfd):
    assert cv2.imdecode(STRAY, cv2.IMREAD_COLOR) is not None
    assert 'extraneous bytes' in capfd.readouterr().err, 'OpenCV alone writes it'
    for _ in range(3):
        assert decoded(STRAY).shape == (48, 64, 3)
    assert capfd.readouterr().err == ''


def test_what_others_say_meanwhile_comes_whole_and_in_order(capfd):
    with without_libjpeg_lines():
        os.write(2, b'first\n')
        cv2.imdecode(STRAY, cv2.IMREAD_COLOR)
        os.write(2, b'second\n')
    os.write(2, b'third\n')
    assert capfd.readouterr().err == 'first\nsecond\nthird\n'


def test_last_words_are_not_lost():
    program = (
        'import os\n'
        'from fisheye_core import quiet_jpeg\n'
        'with quiet_jpeg.without_libjpeg_lines():\n'
        '    quiet_jpeg.stop()\n'
        '    with quiet_jpeg.without_libjpeg_lines():\n'
        '        os.write(2, b"last words")\n'
        '        os._exit(1)\n'
    )
    process = subprocess.run([sys.executable, '-c', program], capture_output=True, check=False)
    assert process.stderr == b'last words'


def test_threads_that_decode_at_once_leave_standard_error_as_it_was(capfd):
    start = Barrier(4)

    def work():
        start.wait()
        for _ in range(100):
            decoded(STRAY)

    threads = [Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    os.write(2, b'afterwards\n')
    assert capfd.readouterr().err == 'afterwards\n'


def test_without_a_standard_error_it_decodes_all_the_same():
    kept = os.dup(2)
    os.close(2)
    try:
        assert decoded(STRAY).shape == (48, 64, 3)
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def test_a_failure_gives_standard_error_back(capfd):
    with pytest.raises(ValueError, match='x'), without_libjpeg_lines():
        raise ValueError('x')
    os.write(2, b'still here\n')
    assert capfd.readouterr().err == 'still here\n'
