"""What FFmpeg says: for whoever captures it, and kept out of the log."""

import logging

import av.logging

captured = av.logging.Capture
"""A context that lists what FFmpeg says meanwhile in this thread: level, part and line."""
ERROR = av.logging.ERROR

av.logging.set_level(av.logging.WARNING)  # That packets got lost is one, each time.
av.logging.set_skip_repeated(False)
logging.getLogger('libav').addHandler(logging.NullHandler())
logging.getLogger('libav').propagate = False
