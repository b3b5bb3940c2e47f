"""What every node loads when it starts."""

import subprocess
import sys

NODES = (
    'fisheye_capture.capture_node',
    'fisheye_undistort.undistort_node',
    'panorama_stitch.nodes.panorama_node',
    'panorama_stitch.nodes.stitch_node',
    'panorama_viewer.viewer_node',
)
RARELY_NEEDED = {'PIL', 'av', 'cryptography', 'matplotlib'}
"""For odd pictures, video, https and reports: time and memory that others should not pay."""


def test_no_node_loads_what_is_rarely_needed():
    code = f'import sys, {", ".join(NODES)}; print(*sys.modules)'
    loaded = subprocess.check_output([sys.executable, '-c', code], text=True).split()
    assert set(NODES) <= set(loaded)
    assert not RARELY_NEEDED & set(loaded)
